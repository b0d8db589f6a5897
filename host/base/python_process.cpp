#include "base/python_process.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"

namespace clarus {

PythonProcess::PythonProcess(const char* script, std::span<const std::string> arguments) {
    std::array<int, 2> ends;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
        fail(ErrorKind::file, "cannot talk to python3: no socket");
    socket_ = ends[0];
    posix_spawn_file_actions_t streams;
    posix_spawn_file_actions_init(&streams);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO}) posix_spawn_file_actions_adddup2(&streams, ends[1], stream);
    // Python would look for modules in the working folder first: what lies there is not to be run.
    const std::string program =
        std::string("import sys\nsys.path[:] = [folder for folder in sys.path if folder]\n") + script;
    std::vector<const char*> words{"python3", "-c", program.c_str()};
    for (const std::string& argument : arguments) words.push_back(argument.c_str());
    words.push_back(nullptr);
    const int error =
        posix_spawnp(&python_, "python3", &streams, nullptr, const_cast<char* const*>(words.data()), environ);
    posix_spawn_file_actions_destroy(&streams);
    close(ends[1]);
    if (error == 0) return;
    close(socket_);
    fail(ErrorKind::file, "there is no python3");
}

PythonProcess::~PythonProcess() {
    close(socket_);
    waitpid(python_, nullptr, 0);
}

bool PythonProcess::send(const void* data, size_t bytes) {
    for (std::string_view rest(static_cast<const char*>(data), bytes); !rest.empty();) {
        const ssize_t sent = ::send(socket_, rest.data(), rest.size(), MSG_NOSIGNAL);
        if (sent < 0) return false;
        rest.remove_prefix(static_cast<size_t>(sent));
    }
    return true;
}

std::string PythonProcess::receive_line() {
    std::string line;
    for (char character; recv(socket_, &character, 1, 0) == 1 && character != '\n';) line += character;
    return line;
}

}  // namespace clarus
