#pragma once

#include <doctest/doctest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <string>

#include "clarus/share.h"
#include "temporary_folder.h"

namespace clarus::test {

/// XDG_RUNTIME_DIR is a folder of the test's own as long as it lives.
class RuntimeFolder {
  public:
    RuntimeFolder() {
        if (const char* variable = std::getenv("XDG_RUNTIME_DIR")) before_ = variable;
        setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    }
    ~RuntimeFolder() {
        if (before_.empty())
            unsetenv("XDG_RUNTIME_DIR");
        else
            setenv("XDG_RUNTIME_DIR", before_.c_str(), 1);
    }
    RuntimeFolder(const RuntimeFolder&) = delete;
    RuntimeFolder& operator=(const RuntimeFolder&) = delete;

    std::filesystem::path operator/(const std::string& name) const { return folder_ / "clarus" / name; }
    bool is_empty() const { return !exists(folder_ / "clarus") || std::filesystem::is_empty(folder_ / "clarus"); }

  private:
    TemporaryFolder folder_;
    std::string before_;
};

struct CloseStream {
    void operator()(clarus_share_stream* stream) const { clarus_share_close(stream); }
    void operator()(clarus_share_reader* reader) const { clarus_share_reader_close(reader); }
};
using SharedStream = std::unique_ptr<clarus_share_stream, CloseStream>;
using SharedReader = std::unique_ptr<clarus_share_reader, CloseStream>;

/// Colour, depth and motion in floats.
inline clarus_share_description plain_description(int width, int height) {
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = {{CLARUS_F32, 3}, width, height, 0};
    description.resources[CLARUS_SHARE_DEPTH] = {{CLARUS_F32, 1}, width, height, 0};
    description.resources[CLARUS_SHARE_MOTION] = {{CLARUS_F32, 2}, width, height, 0};
    return description;
}

inline SharedStream open_stream(const char* name, const clarus_share_description& description) {
    clarus_share_stream* stream = nullptr;
    const clarus_share_status status = clarus_share_open(name, &description, &stream);
    INFO(clarus_share_last_error());
    REQUIRE(status == CLARUS_SHARE_OK);
    return SharedStream(stream);
}

inline SharedReader open_reader(const char* name) {
    clarus_share_reader* reader = nullptr;
    REQUIRE(clarus_share_reader_open(name, &reader) == CLARUS_SHARE_OK);
    return SharedReader(reader);
}

struct Told {
    clarus_share_status status;
    std::string error;  // of the thread that was told
};

/// Connects while the renderer does what it does once a frame.
inline Told connect(clarus_share_reader* reader, clarus_share_stream* stream, int timeout_ms = 5000) {
    auto connected = std::async(std::launch::async, [=] {
        const clarus_share_status status = clarus_share_reader_connect(reader, timeout_ms);
        return Told{status, status == CLARUS_SHARE_OK ? "" : clarus_share_last_error()};
    });
    clarus_share_frame frame;
    while (connected.wait_for(std::chrono::milliseconds(0)) != std::future_status::ready)
        clarus_share_begin(stream, 1, &frame);
    return connected.get();
}

/// Shares a frame with all it had unless told.
inline void share(clarus_share_stream* stream, uint64_t number) {
    clarus_share_frame frame;
    REQUIRE(clarus_share_begin(stream, 0, &frame) == CLARUS_SHARE_OK);
    frame.number = number;
    REQUIRE(clarus_share_end(stream, &frame) == CLARUS_SHARE_OK);
}

}  // namespace clarus::test
