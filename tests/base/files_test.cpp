#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/output_file.h"
#include "base/private_files.h"
#include "child_process.h"
#include "clarus/error.h"
#include "temporary_folder.h"

using namespace clarus;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& path, const std::string& text) {
    OutputFile file(path);
    file.write(std::as_bytes(std::span(text)));
    file.commit();
}

std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

size_t count(const fs::path& folder) { return std::distance(fs::directory_iterator(folder), {}); }

std::string message_of(const fs::path& path) {
    try {
        write(path, "text");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        return error.what();
    }
    return {};
}

}  // namespace

TEST_CASE("a file is there when it is committed, and not before") {
    const TemporaryFolder folder;
    const fs::path path = folder / "name";
    {
        OutputFile file(path);
        file.write(std::as_bytes(std::span("lost", 4)));
        CHECK(file.unfinished().parent_path() == folder.path());
        CHECK_FALSE(fs::exists(path));
    }
    CHECK(count(folder.path()) == 0);
    write(path, "first");
    write(path, "second");
    CHECK(read(path) == "second");
    CHECK(count(folder.path()) == 1);
    const std::string longest(255, 'n');
    write(folder / longest, "long");
    CHECK(read(folder / longest) == "long");
}

TEST_CASE("writers of one file at a time do not meet") {
    const TemporaryFolder folder;
    const fs::path path = folder / "name";
    OutputFile one(path), other(path);
    one.write(std::as_bytes(std::span("one", 3)));
    other.write(std::as_bytes(std::span("other", 5)));
    one.commit();
    CHECK(read(path) == "one");
    other.commit();
    CHECK(read(path) == "other");

    std::atomic<int> failed = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([&] {
            for (int n = 0; n < 20; ++n) failed += !message_of(path).empty();
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(failed == 0);
    CHECK(count(folder.path()) == 1);
}

TEST_CASE("a link at a file's place is replaced, what it leads to is not") {
    const TemporaryFolder folder;
    std::ofstream(folder / "target") << "kept";
    fs::create_symlink(folder / "target", folder / "name");
    fs::create_symlink(folder / "target", folder / ".name.partial");
    write(folder / "name", "new");
    CHECK(read(folder / "target") == "kept");
    CHECK(read(folder / "name") == "new");
    CHECK(fs::is_symlink(folder / ".name.partial"));
}

TEST_CASE("what is no regular file is not replaced") {
    const TemporaryFolder folder;
    CHECK(message_of(folder.path()).ends_with(": Is a directory"));
    REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
    CHECK(message_of(folder / "pipe").ends_with("it is not a regular file"));
    CHECK(fs::is_fifo(folder / "pipe"));
    CHECK(message_of("/dev/null").ends_with("it is not a regular file"));
    CHECK(message_of(folder / "missing" / "name").ends_with(": No such file or directory"));
}

namespace {

// ThreadSanitizer does not follow threads that a forked process makes.
#ifdef __SANITIZE_THREAD__
constexpr bool kFollowsForks = false;
#else
constexpr bool kFollowsForks = true;
#endif

}  // namespace

TEST_CASE("a signal's handler leaves nothing that is half-written, whatever threads are doing" *
          doctest::skip(!kFollowsForks)) {
    for (int attempt = 0; attempt < 15; ++attempt) {
        const TemporaryFolder folder;
        test::ChildProcess writer([&] {
            std::signal(SIGTERM, [](int) {
                remove_unfinished_files();
                _exit(3);
            });
            std::vector<std::thread> threads;
            for (int i = 0; i < 4; ++i)
                threads.emplace_back([&, i] {
                    for (;;) write(folder / std::to_string(i), std::string(1 << 16, 'x'));
                });
            threads.front().join();
            return 0;
        });
        for (int wait = 0; wait < 1000 && !fs::exists(folder / "3"); ++wait)
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        std::this_thread::sleep_for(std::chrono::milliseconds(attempt));
        writer.signal(SIGTERM);
        CHECK(writer.result() == 3);
        for (const auto& entry : fs::directory_iterator(folder.path()))
            CHECK_MESSAGE(entry.path().extension() != ".partial", entry.path());
    }
}

TEST_CASE("only files and folders of the user's own are private") {
    const TemporaryFolder folder;
    const fs::path made = folder / "a" / "b";
    CHECK(make_private_folder(made));
    CHECK(make_private_folder(made));
    CHECK((fs::status(made).permissions() & fs::perms::mask) == fs::perms::owner_all);
    CHECK((fs::status(folder / "a").permissions() & fs::perms::mask) == fs::perms::owner_all);
    fs::permissions(made, fs::perms::others_write, fs::perm_options::add);
    CHECK_FALSE(make_private_folder(made));

    const fs::path file = folder / "file";
    write(file, "text");
    CHECK(read_private_file(file, 4) == "text");
    CHECK_FALSE(read_private_file(file, 3));
    CHECK_FALSE(read_private_file(folder / "missing", 4));
    CHECK_FALSE(read_private_file(folder.path(), 4096));
    fs::create_symlink(file, folder / "link");
    CHECK_FALSE(read_private_file(folder / "link", 4));
    REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
    CHECK_FALSE(read_private_file(folder / "pipe", 4));  // and does not wait for a writer
    fs::permissions(file, fs::perms::group_write, fs::perm_options::add);
    CHECK_FALSE(read_private_file(file, 4));
    fs::permissions(file, fs::perms::group_write, fs::perm_options::remove);
    if (geteuid() != 0) return;
    constexpr uid_t somebody = 12345;
    REQUIRE(chown(file.c_str(), somebody, somebody) == 0);
    CHECK_FALSE(read_private_file(file, 4));
    fs::permissions(made, fs::perms::others_write, fs::perm_options::remove);
    CHECK(make_private_folder(made));
    REQUIRE(chown((folder / "a").c_str(), somebody, somebody) == 0);
    CHECK_FALSE(make_private_folder(made));  // whoever owns the one above may put another in its place
}
