#include <sys/mman.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <thread>

#include "child_process.h"
#include "share_harness.h"

// A renderer and an upscaler as processes that are killed at random instants, and come back. 40 times a policy;
// CLARUS_KILLS says how often else.

using namespace clarus::test;
using namespace std::chrono_literals;

namespace {

constexpr size_t kMostFrames = size_t{1} << 24;
constexpr int kWidth = 64, kHeight = 48;

/// What the processes write down, in memory that outlives them.
struct Record {
    std::atomic<uint64_t> number{0};  // the next frame's
    std::atomic<uint64_t> latest{0};  // taken
    std::atomic<uint64_t> torn{0}, unreset{0}, failed{0};
    std::atomic<bool> stop{false};
    std::atomic<uint8_t> ended[kMostFrames], seen[kMostFrames];
};

class SharedRecord {
  public:
    SharedRecord() {
        void* memory =
            mmap(nullptr, sizeof(Record), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        REQUIRE(memory != MAP_FAILED);
        record_ = static_cast<Record*>(memory);  // zeros are what it begins with
    }
    ~SharedRecord() { munmap(record_, sizeof(Record)); }
    SharedRecord(const SharedRecord&) = delete;
    SharedRecord& operator=(const SharedRecord&) = delete;
    Record& operator*() const { return *record_; }
    Record* operator->() const { return record_; }

  private:
    Record* record_;
};

float value_of(uint64_t number, size_t i) { return static_cast<float>((number * 7919 + i) % 65536); }

void paint(const clarus_share_image& image, uint64_t number) {
    const size_t count = static_cast<size_t>(image.width) * image.height * image.format.channels;
    for (size_t i = 0; i < count; ++i) static_cast<float*>(image.pixels)[i] = value_of(number, i);
}

bool is_whole(const clarus_share_image& image, uint64_t number) {
    const size_t count = static_cast<size_t>(image.width) * image.height * image.format.channels;
    for (size_t i = 0; i < count; ++i)
        if (static_cast<const float*>(image.pixels)[i] != value_of(number, i)) return false;
    return true;
}

bool is_whole(const clarus_share_frame& frame) {
    return is_whole(frame.images[CLARUS_SHARE_COLOR], frame.number) &&
           is_whole(frame.images[CLARUS_SHARE_DEPTH], frame.number) &&
           is_whole(frame.images[CLARUS_SHARE_MOTION], frame.number);
}

int render(Record& record, clarus_share_policy policy) {
    clarus_share_description description = plain_description(kWidth, kHeight);
    description.policy = policy;
    clarus_share_stream* stream = nullptr;
    if (clarus_share_open("killed", &description, &stream) != CLARUS_SHARE_OK) return 1;
    while (!record.stop) {
        clarus_share_frame frame;
        const clarus_share_status status = clarus_share_begin(stream, 100, &frame);
        if (status == CLARUS_SHARE_TIMED_OUT) continue;
        if (status != CLARUS_SHARE_OK) return 1;
        frame.number = record.number++;
        for (const auto kind : {CLARUS_SHARE_COLOR, CLARUS_SHARE_DEPTH, CLARUS_SHARE_MOTION})
            paint(frame.images[kind], frame.number);
        if (clarus_share_end(stream, &frame) != CLARUS_SHARE_OK) return 1;
        record.ended[frame.number] = 1;
    }
    const bool drained = clarus_share_drain(stream, 10000) == CLARUS_SHARE_OK;
    clarus_share_close(stream);
    return drained ? 0 : 1;
}

int upscale(Record& record) {
    clarus_share_reader* reader = nullptr;
    if (clarus_share_reader_open("killed", &reader) != CLARUS_SHARE_OK) return 1;
    clarus_share_status status = CLARUS_SHARE_GONE;
    bool is_first = true;
    uint64_t last = 0;
    for (;;) {
        if (status == CLARUS_SHARE_GONE) {
            status = clarus_share_reader_connect(reader, 10000);
            is_first = true;
        }
        if (status != CLARUS_SHARE_OK) break;
        clarus_share_frame frame;
        status = clarus_share_reader_wait(reader, 10000, &frame);
        if (status == CLARUS_SHARE_ENDED) break;
        if (status != CLARUS_SHARE_OK) continue;
        const bool whole = is_whole(frame) && (std::this_thread::yield(), is_whole(frame));
        if (!whole) ++record.torn;
        if ((is_first || frame.number != last + 1) && !frame.reset) ++record.unreset;
        is_first = false;
        last = frame.number;
        record.seen[frame.number] = 1;
        record.latest = frame.number;
        if (clarus_share_reader_release(reader) != CLARUS_SHARE_OK) return 1;
    }
    clarus_share_reader_close(reader);
    return status == CLARUS_SHARE_ENDED ? 0 : 1;
}

int kills_wanted() {
    const char* variable = std::getenv("CLARUS_KILLS");
    return variable ? std::atoi(variable) : 40;
}

/// Both have found each other: frames that are begun from now on arrive. (What a renderer had ready that is killed
/// before anybody came to it is nobody's.)
bool goes_on(const Record& record) {
    const uint64_t begun = record.number;
    for (int i = 0; i < 20000; ++i) {
        if (record.latest >= begun + 1) return true;
        std::this_thread::sleep_for(1ms);
    }
    return false;
}

void check_kills(clarus_share_policy policy, unsigned seed) {
    const RuntimeFolder folder;
    const SharedRecord record;
    std::mt19937 random(seed);
    const auto rendering = [&] { return render(*record, policy); };
    const auto upscaling = [&] { return upscale(*record); };
    auto renderer = std::make_unique<ChildProcess>(rendering), upscaler = std::make_unique<ChildProcess>(upscaling);
    int renderers = 0, upscalers = 0;
    for (int i = 0; i < kills_wanted(); ++i) {
        REQUIRE(goes_on(*record));
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
        if (random() % 2) {
            renderer->kill();
            renderer = std::make_unique<ChildProcess>(rendering);
            ++renderers;
        } else {
            upscaler->kill();
            upscaler = std::make_unique<ChildProcess>(upscaling);
            ++upscalers;
        }
    }
    REQUIRE(goes_on(*record));
    record->stop = true;
    CHECK(renderer->result() == 0);
    CHECK(upscaler->result() == 0);

    uint64_t ended = 0, unseen = 0;
    for (uint64_t number = 0; number < record->number; ++number) {
        ended += record->ended[number];
        unseen += record->ended[number] && !record->seen[number];
    }
    const std::string unseen_are = policy == CLARUS_SHARE_EVERY_FRAME ? " lost, " : " skipped, ";
    MESSAGE("renderer killed ", renderers, " times, upscaler ", upscalers, " times; ", ended, " frames ready, ", unseen,
            unseen_are, record->torn.load(), " torn");
    CHECK(record->torn == 0);
    CHECK(record->unreset == 0);
    if (policy == CLARUS_SHARE_EVERY_FRAME) CHECK(unseen == 0);
    CHECK(folder.is_empty());
}

}  // namespace

TEST_CASE("killed and restarted, either side goes on, with no frame lost, torn or stuck") {
    check_kills(CLARUS_SHARE_EVERY_FRAME, 1);
}

TEST_CASE("killed and restarted, either side goes on with the newest frame, none torn") {
    check_kills(CLARUS_SHARE_NEWEST_FRAME, 2);
}
