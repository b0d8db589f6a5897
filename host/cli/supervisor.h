#pragma once

#include <string>

namespace clarus::cli {

/// Goes on in a child process, and in another one wherever that dies of a signal, as of a fault in a driver: returns in
/// each of them. The calling process, which holds no device and no thread yet, stays as their supervisor. It hands on
/// SIGINT and SIGTERM, and ends as the last child does, with 1 where three in a row lived for less than ten seconds.
/// `what` is for messages. Errors: file where there can be no process.
void go_on_supervised(const std::string& what);

}  // namespace clarus::cli
