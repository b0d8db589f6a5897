#pragma once

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <string>

namespace clarus {

/// The python3 in the path, which runs a script and talks over its standard input and output.
class PythonProcess {
  public:
    /// `arguments` are the script's. Errors: file where there is no python3.
    PythonProcess(const char* script, std::span<const std::string> arguments);
    /// Ends its input, and waits until it has ended.
    ~PythonProcess();
    PythonProcess(const PythonProcess&) = delete;
    PythonProcess& operator=(const PythonProcess&) = delete;

    /// False where it has ended. Waits while it reads too slowly.
    bool send(const void* data, size_t bytes);
    /// Without the line break; empty where it has ended.
    std::string receive_line();

  private:
    int socket_ = -1;
    pid_t python_ = -1;
};

}  // namespace clarus
