#include "base/platform.h"

#include <fcntl.h>
#include <fnmatch.h>
#include <pwd.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <system_error>
#include <thread>

#include "base/error.h"

namespace clarus {

std::filesystem::path home_folder() {
    if (const char* home = std::getenv("HOME"); home && *home) return home;
    const passwd* user = getpwuid(getuid());
    return user && user->pw_dir ? user->pw_dir : "";
}

std::filesystem::path make_unique_folder(const std::filesystem::path& beginning) {
    std::string name = beginning.string() + "XXXXXX";
    if (!mkdtemp(name.data()))
        fail(ErrorKind::file, "cannot make a temporary folder {}: {}", name, std::generic_category().message(errno));
    return name;
}

bool fits_pattern(const std::string& pattern, const std::string& text) {
    return fnmatch(pattern.c_str(), text.c_str(), 0) == 0;
}

void take_idle_time() {
    const sched_param none{};
    sched_setscheduler(0, SCHED_IDLE, &none);  // where it fails, the thread takes its share as others do
}

void end_with_parent(int parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);
}

FileLock::FileLock(const std::string& path)
    : file_(open(path.c_str(), O_CREAT | O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0600)) {
    constexpr std::chrono::milliseconds pause(10);
    for (int attempt = 0; file_ >= 0 && attempt < 300; ++attempt) {
        if (flock(file_, LOCK_EX | LOCK_NB) == 0) {
            is_held_ = true;
            break;
        }
        if (errno != EWOULDBLOCK && errno != EINTR) break;
        std::this_thread::sleep_for(pause);
    }
}

FileLock::~FileLock() {
    if (file_ >= 0) close(file_);
}

}  // namespace clarus
