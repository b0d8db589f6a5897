#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/parse.h"
#include "clarus/error.h"
#include "noise_sequence.h"
#include "share_programs.h"

// `clarus view` as a process, asked by HTTP.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// A connection to this machine.
class Connection {
  public:
    explicit Connection(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        const timeval patience{30, 0};
        setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
        REQUIRE(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    }
    ~Connection() { close(socket_); }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void say(const std::string& text) const { ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
    std::string rest() const {
        std::string text;
        std::vector<char> part(1 << 16);
        for (ssize_t count; (count = recv(socket_, part.data(), part.size(), 0)) > 0;)
            text.append(part.data(), static_cast<size_t>(count));
        return text;
    }

  private:
    int socket_;
};

struct Answer {
    int status = 0;
    std::string head, body;
};

Answer ask(int port, const std::string& path, const std::string& host = "localhost", const std::string& method = "GET",
           const std::string& more = "") {
    const Connection connection(port);
    connection.say(method + " " + path + " HTTP/1.1\r\n" + (host.empty() ? "" : "Host: " + host + "\r\n") +
                   "Connection: close\r\n" + more + "\r\n");
    const std::string text = connection.rest();
    const size_t end = text.find("\r\n\r\n");
    REQUIRE_MESSAGE(end != std::string::npos, text);
    return {parse_whole<int>(text.substr(9, 3)).value_or(0), text.substr(0, end), text.substr(end + 4)};
}

json data_of(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"data\">";
    const size_t first = page.find(begin) + begin.size();
    return json::parse(page.substr(first, page.find("</script>", first) - first));
}

/// What a program has printed; nothing before it has begun.
std::string out_of(const Program& program) {
    try {
        return program.out();
    } catch (const Error&) {
        return "";
    }
}

/// The command, once it listens.
class View {
  public:
    explicit View(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "view");
        program_ = std::make_unique<Program>(CLARUS_TOOL, arguments);
        const std::string before = "http://127.0.0.1:";
        REQUIRE_MESSAGE(comes_true([&] { return contains(out_of(*program_), "Ctrl-C"); }), out_of(*program_));
        const std::string out = program_->out();
        REQUIRE(out.starts_with(before));
        port_ = parse_whole<int>(out.substr(before.size(), out.find('/', before.size()) - before.size())).value();
    }
    int port() const { return port_; }
    json data() const { return data_of(ask(port_, "/").body); }
    std::string version() const { return ask(port_, "/version").body; }
    Program& program() const { return *program_; }

  private:
    std::unique_ptr<Program> program_;
    int port_ = 0;
};

void draw(const fs::path& folder, const std::string& name, unsigned seed, Size size = {48, 32}) {
    fs::create_directories(folder);
    io::write_image(folder / (name + ".png"), noise(size, 3, 0, 1, seed), io::SampleType::u8);
}

}  // namespace

TEST_CASE("view shows frames and figures as they come, and ends by Ctrl-C") {
    const Workplace place(4);
    fs::create_directory(place / "result");
    View view({(place / "result").string(), "--sequence", place.sequence()});
    CHECK(view.data()["frames"].empty());
    const std::string before = view.version();
    CHECK(before == view.data()["version"]);

    Program upscale(CLARUS_TOOL, {"upscale", place.sequence(), "--model", "bicubic", "--device", test_selector(),
                                  "--output", (place / "result").string()});
    CHECK(upscale.result() == 0);
    REQUIRE(comes_true([&] { return view.version() != before && view.data()["frames"].size() == 4; }));
    const auto is_measured = [&] { return view.data()["results"][0]["quality"].contains("psnr"); };
    REQUIRE(comes_true(is_measured));
    REQUIRE(comes_true([&] { return view.data()["results"][0]["quality"]["frames"][3].contains("psnr"); }));
    const json data = view.data();
    CHECK(data["frames"] == json{"0000", "0001", "0002", "0003"});
    CHECK(data["output_size"] == json{48, 32});
    REQUIRE(data["sources"].size() == 3);
    for (const json& source : data["sources"]) CHECK(source["images"].size() == 4);

    // What clarus report says.
    Program report(CLARUS_TOOL, {"report", (place / "result").string(), "--sequence", place.sequence(), "--output",
                                 (place / "report.html").string()});
    CHECK(report.result() == 0);
    CHECK(data["results"][0]["quality"] == data_of(place.bytes("report.html"))["results"][0]["quality"]);

    // The page stays as long as nothing changes; a frame that is made again changes it.
    const std::string whole = view.version();
    std::this_thread::sleep_for(std::chrono::seconds(2));
    CHECK(view.version() == whole);
    const double psnr = data["results"][0]["quality"]["frames"][1]["psnr"];
    draw(place / "result", "0001", 7);
    REQUIRE(comes_true([&] {
        const json frames = view.data()["results"][0]["quality"]["frames"];
        return frames.size() == 4 && frames[3].contains("psnr") && frames[1]["psnr"] != psnr;
    }));

    view.program().interrupt();
    CHECK(view.program().result() == 0);
}

TEST_CASE("view compares results that are not equally far, without a sequence") {
    const TemporaryFolder folder;
    for (const char* name : {"shot9", "shot10"}) draw(folder / "one", name, 1);
    draw(folder / "other", "shot9", 2);
    const View view({(folder / "one").string(), (folder / "other").string(), "--title", "two"});
    CHECK(view.data()["title"] == "two");
    CHECK(view.data()["frames"] == json{"shot9"});
    draw(folder / "other", "shot10", 3);
    REQUIRE(comes_true([&] { return view.data()["frames"] == json{"shot9", "shot10"}; }));
    CHECK(view.data()["sources"].size() == 2);

    // What goes wrong meanwhile is said, and what is shown stays.
    fs::remove_all(folder / "other");
    REQUIRE(comes_true([&] {
        view.version();
        return contains(view.program().errors(), (folder / "other").string());
    }));
    CHECK(view.data()["frames"].size() == 2);
    draw(folder / "other", "shot9", 4);
    REQUIRE(comes_true([&] { return view.data()["frames"] == json{"shot9"}; }));
}

TEST_CASE("view serves its page alone, to this machine alone") {
    const TemporaryFolder folder;
    draw(folder / "result", "0000", 1);
    const View view({(folder / "result").string()});
    const int port = view.port();

    for (const std::string host : {"localhost", "127.0.0.1", "[::1]", "localhost:1", "127.0.0.1:65535", "[::1]:8080"})
        CHECK_MESSAGE(ask(port, "/version", host).status == 200, host);
    for (const std::string host : {"", "example.org", "localhost.example.org", "127.0.0.1.example.org:80",
                                   "localhost:", "localhost:8x", "localhost:999999", "[::1", "::1", "user@localhost"})
        CHECK_MESSAGE(ask(port, "/", host).status >= 400, host);
    CHECK(ask(port, "/", "example.org").status == 403);
    for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE"}) {
        const Answer answer = ask(port, "/", "localhost", method, "Content-Length: 0\r\n");
        CHECK(answer.status == 405);
        CHECK(contains(answer.head, "Allow: GET, HEAD"));
    }
    for (const char* path : {"/report.html", "/..", "/../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/version/",
                             "//", "/result/0000.png"})
        CHECK_MESSAGE(ask(port, path).status == 404, path);

    const Answer page = ask(port, "/"), head = ask(port, "/", "localhost", "HEAD");
    CHECK(page.status == 200);
    CHECK(head.body.empty());
    CHECK(contains(head.head, "Content-Length: " + std::to_string(page.body.size())));
    for (const char* line : {"Cache-Control: no-store", "X-Content-Type-Options: nosniff", "frame-ancestors 'none'",
                             "Content-Type: text/html; charset=utf-8"})
        CHECK_MESSAGE(contains(page.head, line), line);
    CHECK(contains(page.body, "connect-src 'self'"));
}

TEST_CASE("view waits for nobody") {
    const TemporaryFolder folder;
    draw(folder / "result", "0000", 1);
    const View view({(folder / "result").string()});
    std::vector<std::unique_ptr<Connection>> slow;
    for (int i = 0; i < 8; ++i) {
        slow.push_back(std::make_unique<Connection>(view.port()));
        slow.back()->say("GET / HTTP/1.1\r\nHost: local");
    }
    const auto start = std::chrono::steady_clock::now();
    CHECK(view.data()["frames"].size() == 1);
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(8));
    // A head that does not end is refused; one that stands still is closed.
    const Connection long_one(view.port());
    long_one.say("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(200'000, 'x'));
    const std::string answer = long_one.rest();
    CHECK_MESSAGE((answer.empty() || answer.starts_with("HTTP/1.1 4")), answer.substr(0, 80));
    CHECK(slow.front()->rest().find("200 OK") == std::string::npos);
    view.program().interrupt();
    CHECK(view.program().result() == 0);
}

TEST_CASE("view says what it cannot show before it listens") {
    const TemporaryFolder folder;
    const auto check_refused = [](std::vector<std::string> arguments, int code, const std::vector<std::string>& words) {
        arguments.insert(arguments.begin(), "view");
        Program program(CLARUS_TOOL, arguments);
        CHECK(program.result() == code);
        CHECK(program.out().empty());
        for (const std::string& part : words) CHECK_MESSAGE(contains(program.errors(), part), program.errors());
    };
    check_refused({(folder / "none").string()}, 1, {(folder / "none").string(), "no folder"});
    draw(folder / "result", "0000", 1);
    const std::string result = (folder / "result").string();
    check_refused({result, "--sequence", (folder / "none").string()}, 1, {"cannot read the sequence"});
    check_refused({result, "--port", "65536"}, 2, {"--port"});
    check_refused({}, 2, {"RESULT_DIR"});
    const View view({result});
    const std::string port = std::to_string(view.port());
    check_refused({result, "--port", port}, 1, {"127.0.0.1:" + port, "in use", "--port"});
}
