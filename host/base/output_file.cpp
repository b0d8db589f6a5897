#include "base/output_file.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace clarus {
namespace {

// What a signal handler can read: names in places of their own. Of more files at a time the rest is not known to it.
enum class State { none, beginning, there };
struct Unfinished {
    std::atomic<State> state = State::none;
    std::array<char, PATH_MAX> name;
};
std::array<Unfinished, 256> all_unfinished;
std::atomic<bool> is_ending = false;
static_assert(std::atomic<State>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

/// A thread that has begun a file is not interrupted before the file is there, so that the handler may wait for it.
class SignalsBlocked {
  public:
    SignalsBlocked() {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

  private:
    sigset_t before_;
};

std::optional<size_t> free_place() {
    for (size_t i = 0; i < all_unfinished.size(); ++i) {
        State none = State::none;
        if (all_unfinished[i].state.compare_exchange_strong(none, State::beginning)) return i;
    }
    return std::nullopt;
}

std::filesystem::path name_beside(const std::filesystem::path& path) {
    uint64_t number = 0;
    if (getentropy(&number, sizeof number) != 0) number = static_cast<uint64_t>(getpid());
    return path.parent_path() / fmt::format(".clarus-{:016x}.partial", number);
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path_, error);
    if (std::filesystem::is_directory(status)) give_up(EISDIR);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
        fail(ErrorKind::file, "cannot write {}: it is not a regular file", path_.string());

    int cause = EEXIST;
    for (int attempt = 0; attempt < 100 && cause == EEXIST; ++attempt) {
        unfinished_ = name_beside(path_);
        const std::string name = unfinished_.string();
        const SignalsBlocked blocked;
        if (name.size() < PATH_MAX) place_ = free_place();
        while (is_ending) {
            if (place_) all_unfinished[*std::exchange(place_, std::nullopt)].state = State::none;
            pause();
        }
        if (place_) std::memcpy(all_unfinished[*place_].name.data(), name.c_str(), name.size() + 1);
        file_ = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
        cause = file_ < 0 ? errno : 0;
        if (place_) all_unfinished[*place_].state = file_ < 0 ? State::none : State::there;
        if (file_ < 0) place_.reset();
    }
    if (file_ < 0) give_up(cause);
}

OutputFile::~OutputFile() {
    if (file_ >= 0) {
        close(file_);
        unlink(unfinished_.c_str());
    }
    if (place_) all_unfinished[*place_].state = State::none;
}

void OutputFile::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(file_, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) give_up(errno);
        bytes = bytes.subspan(static_cast<size_t>(written));
    }
}

void OutputFile::commit() {
    // Some file systems have nothing to wait for.
    if (fsync(file_) != 0 && errno != EINVAL && errno != ENOTSUP) give_up(errno);
    if (rename(unfinished_.c_str(), path_.c_str()) != 0) give_up(errno);
    const int closed = close(std::exchange(file_, -1));
    if (closed != 0) give_up(errno);
    // The name as well is to last; where that cannot be had, the file is there nevertheless.
    const std::filesystem::path folder = path_.parent_path();
    const int names = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (names < 0) return;
    fsync(names);
    close(names);
}

void OutputFile::give_up(int cause) const {
    while (is_ending) pause();  // the file was removed, which is no error
    fail(ErrorKind::file, "cannot write {}: {}", path_.string(), std::generic_category().message(cause));
}

void remove_unfinished_files() noexcept {
    is_ending = true;
    for (Unfinished& file : all_unfinished) {
        while (file.state == State::beginning) {
        }
        if (file.state == State::there) unlink(file.name.data());
    }
}

}  // namespace clarus
