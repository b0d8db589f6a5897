#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "child_process.h"
#include "io/file.h"
#include "temporary_folder.h"

namespace clarus::test {

/// A program with its output in files.
class Program {
  public:
    Program(const std::string& file, const std::vector<std::string>& arguments)
        : process_([&] { return run(file, arguments); }) {}

    std::string out() const { return written("out"); }
    std::string errors() const { return written("err"); }
    int result() {
        const int code = process_.result();
        INFO(errors());
        CHECK(code >= 0);
        return code;
    }
    pid_t id() const { return process_.id(); }
    /// Waits, where a signal may have ended it.
    void ended() { process_.result(); }
    void kill() { process_.kill(); }
    /// False where it had ended by itself; `result` then says how.
    bool kill_unless_ended() { return process_.kill_unless_ended(); }
    void interrupt(int signal = SIGINT) const { process_.signal(signal); }

  private:
    /// Nothing before the program has begun to run.
    std::string written(const char* name) const {
        const std::filesystem::path file = folder_ / name;
        return std::filesystem::exists(file) ? io::read_file(file) : "";
    }

    int run(const std::string& file, const std::vector<std::string>& arguments) const {
        const auto redirect = [&](const char* name, int descriptor) {
            dup2(open((folder_ / name).c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), descriptor);
        };
        redirect("out", STDOUT_FILENO);
        redirect("err", STDERR_FILENO);
        std::vector<char*> words{const_cast<char*>(file.c_str())};
        for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
        words.push_back(nullptr);
        execv(file.c_str(), words.data());
        return 127;
    }

    TemporaryFolder folder_;
    ChildProcess process_;
};

}  // namespace clarus::test
