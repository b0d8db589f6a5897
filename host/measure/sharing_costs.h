#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "measure/statistics.h"

namespace clarus::measure {

/// How a game hands its frames to the upscaler.
enum class HandOver {
    in_process,  // it upscales them itself, from where it drew them
    copied,      // it draws into memory of its own, and copies into the shared slot
    in_place     // it draws into the shared slot
};
const char* name_of(HandOver hand_over);

/// One turn of a game, as it tells it to who measures; in seconds and bytes.
struct GameTurn {
    double latency = 0;    // from a frame's being drawn to the game's knowing that it is upscaled, of frames that
                           // are alone: what a fifth of them do not exceed
    double period = 0;     // from frame to frame, as many as asked for
    double wait = 0;       // of that, waiting for a free slot, or for the upscaler within the process
    double hand_over = 0;  // of that, copying and saying that the frame is ready, or submitting it
    double processor = 0, upscaler_processor = 0;  // time a frame, by process
    double memory = 0, upscaler_memory = 0;        // 0: there is no other process
    double slots = 0;                              // of the memory, what the shared slots take
};

/// What a game is asked for in a turn.
struct GameTask {
    int frames = 0;             // one after the other; a few alone before them
    double render_seconds = 0;  // how long it does nothing before each, as if another device drew it
};

/// What is compared with games that upscale in their own process.
struct SharingSetup {
    HandOver hand_over = HandOver::in_place;
    int slots = 3;
    double render_share = 0;  // rendering takes so many times what upscaling takes
    int games = 1;            // at the same time, on one device, each with an upscaler
};

struct SharingOptions {
    std::filesystem::path tool;  // that plays game and upscaler: `tool bench game …`, `tool serve …`
    std::string device, model;
    Size render_size;
    int turns = 7;
    int frames = 20;  // a turn and game
};

struct SharingCosts {
    SharingSetup setup;
    GameTurn in_process, decoupled;        // medians of the turns; means of the games
    std::vector<double> latency_added;     // seconds, of every turn over the in-process one beside it
    std::vector<double> throughput_ratio;  // frames a second over those in process, likewise
};

/// What `clarus bench share` measures of a model.
std::vector<SharingSetup> sharing_setups();

/// Measures them one after the other, each in turns with games that upscale in process, all in processes of their own.
/// `progress` is called with 0…1. Errors: device where one of them fails, with the end of what it said.
std::vector<SharingCosts> measure_sharing(const SharingOptions& options, const std::vector<SharingSetup>& setups,
                                          const std::function<void(double)>& progress);

/// A line of what a game is told, and of what it tells. Errors: device where a line is none.
std::string line_of(const GameTask& task);
std::string line_of(const GameTurn& turn);
GameTask read_task(const std::string& line);
GameTurn read_turn(const std::string& line);

}  // namespace clarus::measure
