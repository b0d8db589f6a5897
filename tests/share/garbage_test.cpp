#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cstring>
#include <functional>
#include <random>
#include <vector>

#include "share/endpoint.h"
#include "share/layout.h"
#include "share/memory.h"
#include "share/wire.h"
#include "share_harness.h"

// What either side says is taken apart and put together wrongly. Whatever comes, the other side answers with an error
// or goes on, and touches nothing but its own memory: AddressSanitizer and the kernel watch.

using namespace clarus::test;

namespace {

constexpr size_t kControlBytes = 2 * SHARE_PAGE_BYTES;

share_head head(uint32_t type, size_t bytes) {
    return {SHARE_MAGIC, SHARE_VERSION, type, static_cast<uint32_t>(bytes)};
}

/// A word that is out of range somewhere, or any.
uint32_t odd_word(std::mt19937& random) {
    constexpr std::array<uint32_t, 12> words{0,          1,          2,          9,          1000,       0x7fffffff,
                                             0x80000000, 0xffffffff, 0x7f800000, 0x7fc00000, 0xff800000, 0x3f000000};
    return random() % 4 == 0 ? static_cast<uint32_t>(random()) : words[random() % words.size()];
}

template <typename Packet>
void set_word(Packet& packet, size_t index, uint32_t word) {
    std::memcpy(reinterpret_cast<unsigned char*>(&packet) + 4 * index, &word, sizeof word);
}

/// Plays a renderer that says what it likes: its memory is writable, its packets are anybody's.
class FakeRenderer {
  public:
    explicit FakeRenderer(clarus_share_policy policy = CLARUS_SHARE_EVERY_FRAME) {
        description = plain_description(16, 8);
        description.user_bytes = 64;
        description.policy = policy;
        REQUIRE(share_lay_out(&description, &layout) == CLARUS_SHARE_OK);
        REQUIRE(share_listen("fake", SHARE_FRAMES_SUFFIX, &endpoint_) == CLARUS_SHARE_OK);
        REQUIRE(share_make_memory("frames", layout.bytes, 0, &descriptors[0], &frames) == CLARUS_SHARE_OK);
        REQUIRE(share_make_memory("control", kControlBytes, 0, &descriptors[1], &pages) == CLARUS_SHARE_OK);
        descriptors[2] = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
        descriptors[3] = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
        packet.head = head(SHARE_STREAM, sizeof packet);
        share_describe_to_wire(&description, &layout, &packet);
        for (int slot = 0; slot < description.slots; ++slot) header(slot) = plain_header(slot);
    }
    ~FakeRenderer() {
        share_close(&connection);
        share_stop_listening(&endpoint_);
        share_unmap(&frames, layout.bytes);
        share_unmap(&pages, kControlBytes);
        for (int& descriptor : descriptors) share_close(&descriptor);
    }
    FakeRenderer(const FakeRenderer&) = delete;
    FakeRenderer& operator=(const FakeRenderer&) = delete;

    /// The reader connects, and is sent `bytes` of the packet with so many of the descriptors.
    clarus_share_status receive(clarus_share_reader* reader, size_t bytes = sizeof(share_stream_packet),
                                int count = SHARE_DESCRIPTORS) {
        share_close(&connection);
        reader_page() = {};
        auto connected = std::async(std::launch::async, [=] {
            const clarus_share_status status = clarus_share_reader_connect(reader, 10000);
            CHECK((status == CLARUS_SHARE_OK || clarus_share_last_error()[0] != '\0'));
            return status;
        });
        wait_for(endpoint_.socket);
        connection = share_accept(endpoint_.socket);
        wait_for(connection);
        share_hello hello;
        REQUIRE(share_receive(connection, &hello, sizeof hello, nullptr, 0, nullptr) == sizeof hello);
        REQUIRE(share_send(connection, &packet, bytes, descriptors.data(), count) == 0);
        return connected.get();
    }

    share_frame_header& header(int slot) {
        return *reinterpret_cast<share_frame_header*>(static_cast<unsigned char*>(frames) + slot * layout.slot_bytes);
    }
    share_reader_page& reader_page() {
        return *reinterpret_cast<share_reader_page*>(static_cast<unsigned char*>(pages) + SHARE_PAGE_BYTES);
    }
    share_publisher_page& page() { return *static_cast<share_publisher_page*>(pages); }
    share_frame_header plain_header(int index) const {
        clarus_share_frame frame{};
        frame.width = 16, frame.height = 8, frame.exposure = 1, frame.has_matrices = 1;
        share_frame_header result{};
        share_frame_to_wire(&frame, static_cast<uint64_t>(index), &result);
        return result;
    }

    clarus_share_description description{};
    share_layout layout{};
    share_stream_packet packet{};
    std::array<int, SHARE_DESCRIPTORS> descriptors{-1, -1, -1, -1};
    void *frames = nullptr, *pages = nullptr;
    int connection = -1;

  private:
    static void wait_for(int socket) {
        pollfd event{socket, POLLIN, 0};
        REQUIRE(poll(&event, 1, 10000) == 1);
    }

    share_endpoint endpoint_{};
};

/// Reads all that a frame points to.
unsigned sum_of(const clarus_share_frame& frame) {
    unsigned sum = 0;
    for (const clarus_share_image& image : frame.images) {
        if (!image.pixels) continue;
        const size_t bytes = image.row_pitch * (image.height - 1) + share_tight_pitch(image.format, image.width);
        const auto* pixels = static_cast<const unsigned char*>(image.pixels);
        for (size_t i = 0; i < bytes; ++i) sum += pixels[i];
    }
    for (size_t i = 0; i < frame.user_bytes; ++i) sum += static_cast<const unsigned char*>(frame.user)[i];
    return sum;
}

/// Takes what there is, as an upscaler would. How often it was refused.
int take_all(clarus_share_reader* reader) {
    for (;;) {
        clarus_share_frame frame;
        const clarus_share_status status = clarus_share_reader_wait(reader, 0, &frame);
        if (status != CLARUS_SHARE_OK) return status == CLARUS_SHARE_PROTOCOL;
        CHECK(sum_of(frame) == 0);
        CHECK(clarus_share_reader_release(reader) == CLARUS_SHARE_OK);
    }
}

/// Plays an upscaler that says what it likes to a real renderer.
class FakeReader {
  public:
    explicit FakeReader(clarus_share_stream* stream) : stream_(stream) {
        REQUIRE(share_connect("game", SHARE_FRAMES_SUFFIX, &connection_) == CLARUS_SHARE_OK);
    }
    ~FakeReader() {
        share_unmap(&pages, kControlBytes);
        for (int& descriptor : descriptors_) share_close(&descriptor);
        share_close(&connection_);
        attend();
        attend();
    }
    FakeReader(const FakeReader&) = delete;
    FakeReader& operator=(const FakeReader&) = delete;

    void say(const void* packet, size_t bytes) { share_send(connection_, packet, bytes, nullptr, 0); }
    void attend() {
        clarus_share_frame frame;
        clarus_share_begin(stream_, 0, &frame);
    }
    /// Says hello properly.
    void connect() {
        const share_hello hello{head(SHARE_HELLO, sizeof hello)};
        say(&hello, sizeof hello);
        attend();
        share_stream_packet packet;
        int count = 0;
        REQUIRE(share_receive(connection_, &packet, sizeof packet, descriptors_.data(), SHARE_DESCRIPTORS, &count) ==
                sizeof packet);
        REQUIRE(count == SHARE_DESCRIPTORS);
        REQUIRE(share_map_memory("control", descriptors_[1], kControlBytes, 1, &pages) == CLARUS_SHARE_OK);
    }
    int frames() const { return descriptors_[0]; }
    share_reader_page& page() {
        return *reinterpret_cast<share_reader_page*>(static_cast<unsigned char*>(pages) + SHARE_PAGE_BYTES);
    }
    /// What the renderer says when it leaves; empty where it does not.
    std::string hear() {
        share_leave packet{};
        const ssize_t bytes = share_receive(connection_, &packet, sizeof packet, nullptr, 0, nullptr);
        return bytes == sizeof packet && packet.head.type == SHARE_LEAVE ? packet.text : "";
    }

    void* pages = nullptr;

  private:
    clarus_share_stream* stream_;
    int connection_ = -1;
    std::array<int, SHARE_DESCRIPTORS> descriptors_{-1, -1, -1, -1};
};

/// A real upscaler can still come, and gets what there is.
void check_still_open(clarus_share_stream* stream) {
    const SharedReader reader = open_reader("game");
    REQUIRE(connect(reader.get(), stream).status == CLARUS_SHARE_OK);
    take_all(reader.get());
    clarus_share_frame frame;
    REQUIRE(clarus_share_begin(stream, 1000, &frame) == CLARUS_SHARE_OK);
    REQUIRE(clarus_share_end(stream, &frame) == CLARUS_SHARE_OK);
    REQUIRE(clarus_share_reader_wait(reader.get(), 1000, &frame) == CLARUS_SHARE_OK);
}

}  // namespace

TEST_CASE("garbage in every word of a stream's description is refused, or is a description") {
    const RuntimeFolder folder;
    std::mt19937 random(1);
    const SharedReader reader = open_reader("fake");
    FakeRenderer renderer;
    const share_stream_packet sound = renderer.packet;
    renderer.page().ready = 2;
    REQUIRE(renderer.receive(reader.get()) == CLARUS_SHARE_OK);
    REQUIRE(take_all(reader.get()) == 0);
    int refused = 0;
    for (size_t word = 0; word < sizeof sound / 4; ++word)
        for (int i = 0; i < 6; ++i) {
            CAPTURE(word);
            renderer.packet = sound;
            set_word(renderer.packet, word, odd_word(random));
            const clarus_share_status status = renderer.receive(reader.get());
            CHECK((status == CLARUS_SHARE_OK || status == CLARUS_SHARE_PROTOCOL || status == CLARUS_SHARE_VERSION));
            refused += status != CLARUS_SHARE_OK;
            if (status == CLARUS_SHARE_OK) take_all(reader.get());
        }
    CHECK(refused > 200);
    renderer.packet = sound;
    CHECK(renderer.receive(reader.get()) == CLARUS_SHARE_OK);
}

TEST_CASE("truncated and overlong packets, and wrong descriptors, are refused") {
    const RuntimeFolder folder;
    const SharedReader reader = open_reader("fake");
    FakeRenderer renderer;
    for (size_t bytes = 1; bytes < sizeof renderer.packet; bytes += 5) {
        CAPTURE(bytes);
        CHECK(renderer.receive(reader.get(), bytes) == CLARUS_SHARE_PROTOCOL);
    }
    for (int count = 0; count < SHARE_DESCRIPTORS; ++count)
        CHECK(renderer.receive(reader.get(), sizeof renderer.packet, count) == CLARUS_SHARE_PROTOCOL);

    const int frames = renderer.descriptors[0];
    int small = -1, pipes[2];
    void* memory = nullptr;
    REQUIRE(share_make_memory("small", SHARE_PAGE_BYTES, 0, &small, &memory) == CLARUS_SHARE_OK);
    int unsealed = memfd_create("unsealed", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    REQUIRE(ftruncate(unsealed, static_cast<off_t>(renderer.layout.bytes)) == 0);
    REQUIRE(pipe(pipes) == 0);
    for (const int wrong : {small, unsealed, pipes[0]}) {
        renderer.descriptors[0] = wrong;
        CHECK(renderer.receive(reader.get()) == CLARUS_SHARE_PROTOCOL);
    }
    renderer.descriptors[0] = frames;
    for (int* event : {&renderer.descriptors[2], &renderer.descriptors[3]}) {
        const int right = *event;
        int endless = open("/dev/zero", O_RDONLY | O_CLOEXEC);
        for (const int wrong : {small, endless, pipes[0], pipes[1]}) {
            *event = wrong;
            CHECK(renderer.receive(reader.get()) == CLARUS_SHARE_PROTOCOL);
        }
        share_close(&endless);
        *event = right;
    }
    fcntl(renderer.descriptors[2], F_SETFL, 0);  // as if it were to make the reader wait
    CHECK(renderer.receive(reader.get()) == CLARUS_SHARE_OK);
    CHECK((fcntl(renderer.descriptors[2], F_GETFL) & O_NONBLOCK) != 0);
    share_unmap(&memory, SHARE_PAGE_BYTES);
    for (int* descriptor : {&small, &unsealed, &pipes[0], &pipes[1]}) share_close(descriptor);
}

TEST_CASE("another version of the protocol is told apart from nonsense") {
    const RuntimeFolder folder;
    const SharedReader reader = open_reader("fake");
    FakeRenderer renderer;
    renderer.packet.head.version = SHARE_VERSION + 1;
    CHECK(renderer.receive(reader.get()) == CLARUS_SHARE_VERSION);
    renderer.packet.head.bytes = 12345;  // whatever that version has there
    CHECK(renderer.receive(reader.get(), 100) == CLARUS_SHARE_VERSION);

    const SharedStream stream = open_stream("game", plain_description(4, 4));
    FakeReader other(stream.get());
    share_hello hello{head(SHARE_HELLO, sizeof hello)};
    hello.head.version = 7;
    other.say(&hello, sizeof hello);
    other.attend();
    CHECK(other.hear() == "the other side speaks version 7 of the protocol, this one version 2");
}

TEST_CASE("garbage in every word of a frame's header is refused, or is a frame") {
    const RuntimeFolder folder;
    std::mt19937 random(2);
    for (const clarus_share_policy policy : {CLARUS_SHARE_EVERY_FRAME, CLARUS_SHARE_NEWEST_FRAME}) {
        FakeRenderer renderer(policy);
        const SharedReader reader = open_reader("fake");
        int refused = 0;
        for (size_t word = 0; word < sizeof(share_frame_header) / 4; ++word)
            for (int i = 0; i < 6; ++i) {
                CAPTURE(word);
                renderer.header(0) = renderer.plain_header(0);
                set_word(renderer.header(0), word, odd_word(random));
                renderer.page().ready = policy == CLARUS_SHARE_EVERY_FRAME ? 1 : share_word(0, 0);
                REQUIRE(renderer.receive(reader.get()) == CLARUS_SHARE_OK);
                refused += take_all(reader.get());
            }
        CHECK(refused > 80);
    }
}

TEST_CASE("garbage in the renderer's page is refused") {
    const RuntimeFolder folder;
    std::mt19937_64 random(3);
    for (const clarus_share_policy policy : {CLARUS_SHARE_EVERY_FRAME, CLARUS_SHARE_NEWEST_FRAME}) {
        FakeRenderer renderer(policy);
        const SharedReader reader = open_reader("fake");
        for (int i = 0; i < 100; ++i) {
            renderer.page().ready = 0;
            REQUIRE(renderer.receive(reader.get()) == CLARUS_SHARE_OK);
            REQUIRE(take_all(reader.get()) == 0);
            renderer.page().ready = random() | 16;  // beyond the slots, or a slot of which it is not
            CHECK(take_all(reader.get()) == 1);
            clarus_share_frame frame;
            CHECK(clarus_share_reader_wait(reader.get(), 0, &frame) == CLARUS_SHARE_PROTOCOL);
        }
        renderer.page().ready = 0;
        REQUIRE(renderer.receive(reader.get()) == CLARUS_SHARE_OK);
        renderer.page().ready = policy == CLARUS_SHARE_EVERY_FRAME ? 2 : share_word(1, 1);
        CHECK(take_all(reader.get()) == 0);
        renderer.page().ready = policy == CLARUS_SHARE_EVERY_FRAME ? 1 : share_word(0, 1);  // backwards
        CHECK(take_all(reader.get()) == 1);
    }
}

TEST_CASE("a reader that talks nonsense, or says nothing, leaves the renderer as it was") {
    const RuntimeFolder folder;
    std::mt19937 random(4);
    const SharedStream stream = open_stream("game", plain_description(4, 4));
    for (int i = 0; i < 60; ++i) {
        FakeReader reader(stream.get());
        std::array<unsigned char, 600> bytes;
        for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(random());
        share_hello hello{head(SHARE_HELLO, sizeof hello)};
        if (i % 3 == 1) {
            set_word(hello, random() % 4, odd_word(random));
            hello.head.type ^= 4;
            std::memcpy(bytes.data(), &hello, sizeof hello);
        }
        if (i % 3 != 2) reader.say(bytes.data(), i % 3 == 1 ? sizeof hello : 1 + random() % bytes.size());
        reader.attend();
        CHECK(clarus_share_stream_state(stream.get()).connected == 0);
        if (i % 3 != 2) CHECK(reader.hear() != "");
    }
    check_still_open(stream.get());

    const FakeReader silent(stream.get());  // is turned away after a second
    const SharedReader next = open_reader("game");
    CHECK(connect(next.get(), stream.get()).status == CLARUS_SHARE_OK);
}

TEST_CASE("garbage in a reader's page ends its connection alone") {
    const RuntimeFolder folder;
    std::mt19937_64 random(5);
    for (const clarus_share_policy policy : {CLARUS_SHARE_EVERY_FRAME, CLARUS_SHARE_NEWEST_FRAME}) {
        clarus_share_description description = plain_description(4, 4);
        description.policy = policy;
        const SharedStream stream = open_stream("game", description);
        share(stream.get(), 0);
        for (int i = 0; i < 50; ++i) {
            FakeReader reader(stream.get());
            reader.connect();
            CHECK(clarus_share_stream_state(stream.get()).connected == 1);
            reader.page().taken = reader.page().released = random() | 15;
            reader.attend();
            CHECK(clarus_share_stream_state(stream.get()).connected == 0);
            CHECK(reader.hear() != "");
        }
        {
            FakeReader reader(stream.get());
            reader.connect();
            reader.say("anything at all", 15);
            reader.attend();
            CHECK(clarus_share_stream_state(stream.get()).connected == 0);
        }
        check_still_open(stream.get());
    }
}

TEST_CASE("a reader cannot write frames, nor take their memory away") {
    const RuntimeFolder folder;
    const SharedStream stream = open_stream("game", plain_description(4, 4));
    FakeReader reader(stream.get());
    reader.connect();
    CHECK(mmap(nullptr, SHARE_PAGE_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, reader.frames(), 0) == MAP_FAILED);
    CHECK(pwrite(reader.frames(), "x", 1, 0) < 0);
    CHECK(ftruncate(reader.frames(), 0) < 0);
    CHECK(fallocate(reader.frames(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, SHARE_PAGE_BYTES) < 0);
    CHECK(fcntl(reader.frames(), F_ADD_SEALS, F_SEAL_WRITE) < 0);
}
