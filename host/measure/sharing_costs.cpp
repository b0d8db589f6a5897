#include "measure/sharing_costs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.h"
#include "io/json_reader.h"
#include "measure/child.h"

namespace clarus::measure {
namespace {

using nlohmann::json;

struct Field {
    const char* name;
    double GameTurn::*value;
};
constexpr std::array kFields{
    Field{"latency", &GameTurn::latency},     Field{"period", &GameTurn::period},
    Field{"wait", &GameTurn::wait},           Field{"hand_over", &GameTurn::hand_over},
    Field{"processor", &GameTurn::processor}, Field{"upscaler_processor", &GameTurn::upscaler_processor},
    Field{"memory", &GameTurn::memory},       Field{"upscaler_memory", &GameTurn::upscaler_memory},
    Field{"slots", &GameTurn::slots}};

template <typename Reduce>
GameTurn reduced(const std::vector<GameTurn>& turns, Reduce reduce) {
    GameTurn result;
    for (const Field& field : kFields) {
        std::vector<double> values;
        for (const GameTurn& turn : turns) values.push_back(turn.*field.value);
        result.*field.value = reduce(values);
    }
    return result;
}

double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

[[noreturn]] void fail_with(Child& child, const char* what) {
    while (child.hear()) continue;
    fail(ErrorKind::device, "{} ended: {}", what, child.last_words());
}

/// A game, and its upscaler where that is another process.
class Game {
  public:
    Game(const SharingOptions& options, const SharingSetup& setup, const std::string& stream) {
        const bool is_shared = setup.hand_over != HandOver::in_process;
        if (is_shared)
            upscaler_ = std::make_unique<Child>(std::vector<std::string>{
                options.tool.string(), "serve", stream, "--model", options.model, "--device", options.device});
        game_ = std::make_unique<Child>(std::vector<std::string>{
            options.tool.string(), "bench", "game", stream, name_of(setup.hand_over), options.model, options.device,
            fmt::to_string(options.render_size.width), fmt::to_string(options.render_size.height),
            fmt::to_string(setup.slots), fmt::to_string(is_shared ? upscaler_->id() : 0)});
    }
    ~Game() {
        game_->end_input();
        while (game_->hear()) continue;  // the upscaler ends with the stream
        if (upscaler_)
            while (upscaler_->hear()) continue;
    }
    Game(const Game&) = delete;
    Game& operator=(const Game&) = delete;

    void begin(const GameTask& task) { game_->say(line_of(task)); }
    GameTurn end() {
        for (;;) {
            const std::optional<std::string> line = game_->hear();
            if (!line) fail_with(*game_, "the game");
            if (line->starts_with('{')) return read_turn(*line);
        }
    }

  private:
    std::unique_ptr<Child> upscaler_, game_;
};

/// Games that play at the same time.
class Games {
  public:
    Games(const SharingOptions& options, const SharingSetup& setup) {
        static int streams = 0;
        for (int i = 0; i < setup.games; ++i)
            games_.push_back(std::make_unique<Game>(options, setup, fmt::format("bench-{}-{}", getpid(), streams++)));
        turn({.frames = 2, .render_seconds = 0});  // whatever is done at first
    }

    GameTurn turn(const GameTask& task) {
        for (const auto& game : games_) game->begin(task);
        std::vector<GameTurn> turns;
        for (const auto& game : games_) turns.push_back(game->end());
        return reduced(turns, mean);
    }

  private:
    std::vector<std::unique_ptr<Game>> games_;
};

SharingCosts measure_setup(const SharingOptions& options, const SharingSetup& setup, Games& in_process,
                           const std::function<void()>& turned) {
    Games decoupled(options, setup);
    const double upscaling = in_process.turn({.frames = options.frames, .render_seconds = 0}).period;
    const GameTask task{options.frames, setup.render_share * upscaling};
    SharingCosts costs;
    costs.setup = setup;
    std::vector<GameTurn> before, after;
    for (int turn = 0; turn < options.turns; ++turn) {
        const bool is_first = turn % 2 == 0;  // each goes first as often
        if (is_first) before.push_back(in_process.turn(task));
        after.push_back(decoupled.turn(task));
        if (!is_first) before.push_back(in_process.turn(task));
        costs.latency_added.push_back(after.back().latency - before.back().latency);
        costs.throughput_ratio.push_back(before.back().period / after.back().period);
        turned();
    }
    costs.in_process = reduced(before, [](const std::vector<double>& values) { return median(values); });
    costs.decoupled = reduced(after, [](const std::vector<double>& values) { return median(values); });
    return costs;
}

json parse(const std::string& line) {
    const std::optional<json> object = io::try_parse_json(line);
    if (!object || !object->is_object())
        fail(ErrorKind::device, "not what is told between a game and who measures: {}", line);
    return *object;
}

}  // namespace

const char* name_of(HandOver hand_over) {
    switch (hand_over) {
        case HandOver::in_process:
            return "in-process";
        case HandOver::copied:
            return "copied";
        case HandOver::in_place:
            break;
    }
    return "in-place";
}

std::vector<SharingSetup> sharing_setups() {
    using enum HandOver;
    return {{copied, 3, 0, 1},   {in_place, 2, 0, 1}, {in_place, 3, 0, 1},   {in_place, 4, 0, 1},
            {in_place, 3, 2, 1}, {in_place, 3, 1, 1}, {in_place, 3, 0.5, 1}, {in_place, 3, 0, 4}};
}

std::vector<SharingCosts> measure_sharing(const SharingOptions& options, const std::vector<SharingSetup>& setups,
                                          const std::function<void(double)>& progress) {
    std::vector<SharingCosts> results;
    std::unique_ptr<Games> in_process;
    int games = 0;
    double turns = 0;
    for (const SharingSetup& setup : setups) {
        if (setup.games != games) {
            in_process.reset();
            in_process = std::make_unique<Games>(
                options, SharingSetup{HandOver::in_process, setup.slots, 0, games = setup.games});
        }
        results.push_back(measure_setup(options, setup, *in_process, [&] {
            progress(++turns / static_cast<double>(setups.size()) / options.turns);
        }));
    }
    return results;
}

std::string line_of(const GameTask& task) {
    return json{{"frames", task.frames}, {"render_seconds", task.render_seconds}}.dump();
}

std::string line_of(const GameTurn& turn) {
    json line = json::object();
    for (const Field& field : kFields) line[field.name] = turn.*field.value;
    return line.dump();
}

GameTask read_task(const std::string& line) {
    const json object = parse(line);
    return {object.value("frames", 0), object.value("render_seconds", 0.0)};
}

GameTurn read_turn(const std::string& line) {
    const json object = parse(line);
    GameTurn turn;
    for (const Field& field : kFields) turn.*field.value = object.value(field.name, 0.0);
    return turn;
}

}  // namespace clarus::measure
