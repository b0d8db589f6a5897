#include "measure/child.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "base/error.h"

namespace clarus::measure {
namespace {

std::vector<std::string> own_environment() {
    std::vector<std::string> result;
    for (char** variable = environ; *variable; ++variable) result.emplace_back(*variable);
    return result;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

}  // namespace

Child::Child(std::vector<std::string> arguments, std::vector<std::string> environment) : output_(nullptr, fclose) {
    // Not pipes: writing to a process that has ended is an error then, and no signal.
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        fail(ErrorKind::device, "no connection to a new process: {}", std::strerror(errno));
    output_.reset(fdopen(ends[0], "r"));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_adddup2(&actions, ends[1], descriptor);
    const int error = posix_spawn(&id_, arguments.front().c_str(), &actions, nullptr, pointers(arguments).data(),
                                  pointers(environment).data());
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (error == 0) return;
    id_ = -1;
    fail(ErrorKind::device, "cannot run {}: {}", arguments.front(), std::strerror(error));
}

Child::Child(std::vector<std::string> arguments) : Child(std::move(arguments), own_environment()) {}

Child::~Child() {
    if (id_ < 0) return;
    kill(id_, SIGKILL);
    wait();
}

void Child::say(const std::string& line) const {
    const std::string text = line + '\n';
    send(fileno(output_.get()), text.data(), text.size(), MSG_NOSIGNAL);
}

std::optional<std::string> Child::hear() {
    std::string line;
    for (std::array<char, 4096> part{}; std::fgets(part.data(), part.size(), output_.get());) {
        line += part.data();
        if (line.ends_with('\n')) break;
    }
    if (line.empty()) return std::nullopt;
    said_ += line;
    if (line.ends_with('\n')) line.pop_back();
    return line;
}

std::string Child::last_words() const { return said_.substr(said_.size() > 400 ? said_.size() - 400 : 0); }

void Child::end_input() const { shutdown(fileno(output_.get()), SHUT_WR); }

int Child::wait() {
    int status = 0;
    waitpid(std::exchange(id_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace clarus::measure
