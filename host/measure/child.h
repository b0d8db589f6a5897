#pragma once

#include <sys/types.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace clarus::measure {

/// A process of a program, which is talked to in lines: what it reads from its input, and what it writes to its output
/// and its errors. Killed where it still runs in the end.
class Child {
  public:
    /// `arguments` begin with the program's path. Errors: device, naming it, where it cannot be started.
    Child(std::vector<std::string> arguments, std::vector<std::string> environment);
    explicit Child(std::vector<std::string> arguments);  // in this process's environment
    ~Child();
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    pid_t id() const { return id_; }
    void say(const std::string& line) const;
    /// The next line, without its end; none after the last. Waits.
    std::optional<std::string> hear();
    /// The end of all that was heard, for messages.
    std::string last_words() const;

    void end_input() const;
    /// Its exit code, or -1 where a signal ended it. Waits.
    int wait();

  private:
    pid_t id_ = -1;
    std::unique_ptr<FILE, int (*)(FILE*)> output_;
    std::string said_;
};

}  // namespace clarus::measure
