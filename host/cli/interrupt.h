#pragma once

namespace clarus::cli {

/// From here on SIGINT, SIGTERM and SIGHUP remove what is half-written (base/output_file.h) before they end the
/// process.
void remove_unfinished_files_when_ended();

/// Takes Ctrl-C and the signal to end (SIGINT, SIGTERM) as long as it lives, so that a command that runs until then can
/// leave in good order; a second one ends the process at once. One at a time.
class Interrupt {
  public:
    Interrupt();
    ~Interrupt();
    Interrupt(const Interrupt&) = delete;
    Interrupt& operator=(const Interrupt&) = delete;

    static bool came();
    /// How long a wait may be before it looks whether one came.
    static constexpr int look_milliseconds = 100;
};

}  // namespace clarus::cli
