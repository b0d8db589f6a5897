#include "cli/share_publisher.h"

#include "base/log.h"
#include "cli/interrupt.h"
#include "cli/share_error.h"

namespace clarus::cli {
namespace {

clarus_share_stream* open_stream(const std::string& name, const clarus_share_description& description) {
    clarus_share_stream* stream = nullptr;
    check_share(clarus_share_open(name.c_str(), &description, &stream));
    return stream;
}

}  // namespace

SharePublisher::SharePublisher(const std::string& name, const clarus_share_description& description)
    : stream_(open_stream(name, description), clarus_share_close) {}

bool SharePublisher::begin(clarus_share_frame& frame) {
    while (!Interrupt::came()) {
        const clarus_share_status status = clarus_share_begin(stream_.get(), Interrupt::look_milliseconds, &frame);
        tell_message();
        if (status == CLARUS_SHARE_OK) return true;
        if (status != CLARUS_SHARE_TIMED_OUT) fail_with_share(status);
    }
    return false;
}

void SharePublisher::copy(const clarus_share_frame& frame, clarus_share_kind kind, const void* pixels) {
    if (frame.images[kind].pixels) check_share(clarus_share_copy(&frame, kind, pixels, 0));
}

void SharePublisher::end(const clarus_share_frame& frame) { check_share(clarus_share_end(stream_.get(), &frame)); }

void SharePublisher::drain() {
    while (!Interrupt::came()) {
        const clarus_share_status status = clarus_share_drain(stream_.get(), Interrupt::look_milliseconds);
        tell_message();
        if (status == CLARUS_SHARE_OK) return;
        if (status != CLARUS_SHARE_TIMED_OUT) fail_with_share(status);
    }
}

// An upscaler that cannot take the frames says so.
void SharePublisher::tell_message() {
    const std::string message = state().message;
    if (!message.empty() && message != told_) log(LogLevel::warning, "the upscaler left: {}", message);
    told_ = message;
}

}  // namespace clarus::cli
