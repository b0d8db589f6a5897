#include "io/safetensors.h"

#include <Imath/half.h>
#include <doctest/doctest.h>

#include <cstring>
#include <fstream>
#include <map>
#include <random>
#include <span>

#include "clarus/error.h"
#include "io/safetensors_writer.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::io;
using doctest::Contains;

namespace {

template <typename T>
std::string bytes_of(const std::vector<T>& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

std::string with_header(const std::string& header, const std::string& body) {
    return bytes_of<uint64_t>({header.size()}) + header + body;
}

const std::string good_header =
    R"({"__metadata__": {"pipeline": "enss", "scale": "2", "name": "x"},
        "a.weight": {"dtype": "F32", "shape": [2, 3], "data_offsets": [0, 24]},
        "b": {"dtype": "F16", "shape": [3], "data_offsets": [24, 30]},
        "c": {"dtype": "I8", "shape": [], "data_offsets": [30, 31]},
        "none": {"dtype": "I32", "shape": [4, 0], "data_offsets": [31, 31]},
        "d": {"dtype": "I32", "shape": [1], "data_offsets": [31, 35]}}   )";
const std::string good_body = bytes_of<float>({1, 2, 3, 4, 5, 6.5f}) +
                              bytes_of<uint16_t>({0x3c00, 0xc000, 0x0001}) +  // 1, −2, the smallest half
                              bytes_of<int8_t>({-7}) + bytes_of<int32_t>({123456});

class File {
  public:
    explicit File(const std::string& bytes) {
        std::ofstream(folder_ / "model.safetensors", std::ios::binary).write(bytes.data(), std::ssize(bytes));
    }
    Safetensors read() const { return Safetensors::read(folder_ / "model.safetensors"); }

  private:
    TemporaryFolder folder_;
};

/// The message for a file with one tensor "t" of this entry, and a body of 8 bytes.
doctest::String message_for(const std::string& entry, const std::string& more = "") {
    try {
        File(with_header(R"({"t": )" + entry + more + "}", std::string(8, '\0'))).read();
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        CHECK(std::string(error.what()).find("model.safetensors") != std::string::npos);
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("safetensors: tensors and metadata as they were written") {
    const Safetensors file = File(with_header(good_header, good_body)).read();
    CHECK(file.metadata().at("pipeline") == "enss");
    CHECK(file.tensors().size() == 5);
    CHECK(file.has("a.weight"));
    CHECK_FALSE(file.has("__metadata__"));

    const Tensor& a = file.tensors().at("a.weight");
    CHECK(a.shape == std::vector<int64_t>{2, 3});
    CHECK(a.elements() == 6);
    CHECK(a.floats() == std::vector<float>{1, 2, 3, 4, 5, 6.5f});
    CHECK(file.tensors().at("b").floats() == std::vector<float>{1, -2, 0x1p-24f});
    CHECK(file.tensors().at("c").elements() == 1);
    CHECK(static_cast<int8_t>(file.tensors().at("c").bytes[0]) == -7);
    CHECK(file.tensors().at("none").elements() == 0);
    CHECK_THROWS_WITH_AS(file.tensors().at("d").floats(), Contains("model.safetensors: tensor d holds whole numbers"),
                         Error);

    const Safetensors copy = file;
    CHECK(copy.tensors().at("a.weight").floats() == a.floats());
}

TEST_CASE("safetensors: what is required is there, or named with what was expected") {
    const Safetensors file = File(with_header(good_header, good_body)).read();
    const int64_t fits[] = {2, -1}, other[] = {2, 4}, flat[] = {6};
    CHECK(file.require("a.weight", fits).elements() == 6);
    CHECK_THROWS_WITH_AS(file.require("a.weight", other),
                         Contains("a.weight has the shape [2, 3] where [2, 4] is expected"), Error);
    CHECK_THROWS_WITH_AS(file.require("a.weight", flat), Contains("[6]"), Error);
    CHECK_THROWS_WITH_AS(file.require("body.0.weight", fits), Contains("lacks the tensor body.0.weight"), Error);
    CHECK(file.require_metadata("scale") == "2");
    CHECK_THROWS_WITH_AS(file.require_metadata("features"), Contains("lacks the metadata \"features\""), Error);
    CHECK(file.require_integer("scale", 2, 4) == 2);
    CHECK_THROWS_WITH_AS(file.require_integer("scale", 3, 4), Contains("\"scale\" must be a whole number from 3 to 4"),
                         Error);
    CHECK_THROWS_WITH_AS(file.require_integer("name", 0, 4), Contains("not \"x\""), Error);
}

TEST_CASE("safetensors: files that are cut short or claim too much") {
    CHECK_THROWS_WITH_AS(Safetensors::read("/nonexistent/model.safetensors"), Contains("No such file"), Error);
    CHECK_THROWS_WITH_AS(File("").read(), Contains("only 0 bytes"), Error);
    CHECK_THROWS_WITH_AS(File("1234567").read(), Contains("only 7 bytes"), Error);
    const std::string whole = with_header(good_header, good_body);
    for (size_t size = 0; size < whole.size(); ++size) CHECK_THROWS_AS(File(whole.substr(0, size)).read(), Error);
    CHECK_THROWS_WITH_AS(File(whole + "x").read(), Contains("1 bytes at the end belong to no tensor"), Error);
    for (const uint64_t length :
         {uint64_t{1} << 63, ~uint64_t{0}, ~uint64_t{0} - 7, uint64_t{200'000'000}, whole.size() - 7})
        CHECK_THROWS_WITH_AS(File(bytes_of<uint64_t>({length}) + whole.substr(8)).read(),
                             Contains(std::to_string(length).c_str()), Error);
}

TEST_CASE("safetensors: headers that are wrong") {
    const auto file = [](const std::string& header) { return File(with_header(header, "")).read(); };
    CHECK_THROWS_WITH_AS(file("{\"t\": "), Contains("not valid JSON"), Error);
    CHECK_THROWS_WITH_AS(file("[]"), Contains("the top level must be an object"), Error);
    CHECK_THROWS_WITH_AS(file("{} {}"), Contains("not valid JSON"), Error);
    CHECK_THROWS_WITH_AS(file(R"({"__metadata__": {"scale": 2}})"),
                         Contains("__metadata__.scale must be a string, not 2"), Error);
    CHECK_THROWS_WITH_AS(file(R"({"__metadata__": []})"), Contains("__metadata__ must be an object"), Error);
    CHECK_THROWS_WITH_AS(file(R"({"a": {}, "a": {}})"), Contains("the key \"a\" stands twice"), Error);
    CHECK(file("{}").tensors().empty());
    // Nested as deep as the file is long: an error, not an exhausted stack.
    CHECK_THROWS_AS(file(std::string(1'000'000, '[')), Error);
    CHECK_THROWS_AS(file(R"({"a":)" + std::string(100'000, '[') + std::string(100'000, ']') + "}"), Error);
}

TEST_CASE("safetensors: entries that are wrong") {
    const auto entry = [](const std::string& type, const std::string& shape, const std::string& offsets) {
        return R"({"dtype": ")" + type + R"(", "shape": )" + shape + R"(, "data_offsets": )" + offsets + "}";
    };
    CHECK(message_for(entry("F32", "[2]", "[0, 8]")) == "no error");
    const auto expect = [](const doctest::String& message, const char* part) { CHECK(message == Contains(part)); };
    expect(message_for("7"), "t must be an object");
    expect(message_for(R"({"shape": [2], "data_offsets": [0, 8]})"), "t lacks the field \"dtype\"");
    expect(message_for(R"({"dtype": "F32", "data_offsets": [0, 8]})"), "t lacks the field \"shape\"");
    expect(message_for(R"({"dtype": "F32", "shape": [2]})"), "t lacks the field \"data_offsets\"");
    expect(message_for(entry("F64", "[1]", "[0, 8]")),
           "t.dtype must be one of \"F32\", \"F16\", \"I8\", \"I32\", not \"F64\"");
    expect(message_for(entry("F32", "2", "[0, 8]")), "t.shape must be a list");
    expect(message_for(entry("F32", "[1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2]", "[0, 8]")),
           "t.shape must be a list of at most 16, not a list of 17");
    expect(message_for(entry("F32", "[-2]", "[0, 8]")), "t.shape[0] must be a whole number");
    expect(message_for(entry("F32", "[1, 2.0]", "[0, 8]")), "t.shape[1] must be a whole number");
    expect(message_for(entry("F32", "[18446744073709551615]", "[0, 8]")), "t.shape[0] must be");
    expect(message_for(entry("F32", "[99999999999999999999999]", "[0, 8]")), "t.shape[0] must be");
    expect(message_for(entry("F32", "[4611686018427387904, 4]", "[0, 8]")), "too large");
    expect(message_for(entry("F32", "[4611686018427387904]", "[0, 0]")), "too large");
    expect(message_for(entry("F32", "[2]", "[0]")), "t.data_offsets must be a list of 2");
    expect(message_for(entry("F32", "[2]", "[0, 16]")), "t.data_offsets[1] must be a whole number from 0 to 8, not 16");
    expect(message_for(entry("F32", "[2]", "[8, 0]")), "t.data_offsets[1] must be 8, not 0");
    expect(message_for(entry("F32", "[2]", "[-8, 0]")), "t.data_offsets[0] must be");
    expect(message_for(entry("F32", "[3]", "[0, 8]")),
           "tensor t of the shape [3] takes 12 bytes, but its data_offsets hold 8");
    expect(message_for(entry("F32", "[1]", "[4, 8]")), "4 bytes before tensor t belong to none");
    expect(message_for(entry("F32", "[1]", "[0, 4]")), "4 bytes at the end belong to no tensor");
    expect(message_for(entry("F32", "[2]", "[0, 8]"), ", \"u\": " + entry("F32", "[1]", "[4, 8]")),
           "tensors t and u overlap");
    expect(message_for(entry("F32", "[2]", "[0, 8]"), ", \"u\": " + entry("F32", "[2]", "[0, 8]")), "overlap");
    expect(message_for(entry("F32", "[2]", "[0, 8]"), ", \"u\": " + entry("F32", "[0]", "[4, 4]")), "overlap");
}

TEST_CASE("safetensors: damaged anywhere, a file is read or refused") {
    const std::string whole = with_header(good_header, good_body);
    std::mt19937 random(1);
    int refused = 0;
    for (int round = 0; round < 3000; ++round) {
        std::string damaged = whole;
        for (int flips = 1 + round % 3; flips > 0; --flips)
            damaged[random() % damaged.size()] ^= static_cast<char>(1 << random() % 8);
        try {
            const Safetensors file = File(damaged).read();
            for (const auto& [name, tensor] : file.tensors()) CHECK(tensor.bytes.size() <= good_body.size());
        } catch (const Error&) {
            ++refused;
        }
    }
    CHECK(refused > 1000);
}

TEST_CASE("what is written as a safetensors file is read again") {
    const TemporaryFolder folder;
    const float numbers[] = {1.5f, -2};
    const int8_t bytes[] = {-127, 0, 127};
    const int32_t whole[] = {1 << 30};
    std::map<std::string, io::NewTensor> tensors;
    tensors["z"] = io::NewTensor::of(io::DataType::i8, {3, 1}, std::span<const int8_t>(bytes));
    tensors["a"] = io::NewTensor::of(io::DataType::f32, {2}, std::span<const float>(numbers));
    tensors["m"] = io::NewTensor::of(io::DataType::i32, {1}, std::span<const int32_t>(whole));
    tensors["none"] = {io::DataType::f16, {0}, {}};
    write_safetensors(folder / "written.safetensors", {{"pipeline", "enss"}, {"quotes", "\"\\"}}, tensors);
    const io::Safetensors read = io::Safetensors::read(folder / "written.safetensors");
    CHECK(read.metadata() == std::map<std::string, std::string>{{"pipeline", "enss"}, {"quotes", "\"\\"}});
    REQUIRE(read.tensors().size() == 4);
    CHECK(read.tensors().at("a").floats() == std::vector<float>{1.5f, -2});
    CHECK(read.tensors().at("z").type == io::DataType::i8);
    CHECK(read.tensors().at("z").shape == std::vector<int64_t>{3, 1});
    CHECK(std::memcmp(read.tensors().at("z").bytes.data(), bytes, 3) == 0);
    CHECK(std::memcmp(read.tensors().at("m").bytes.data(), whole, 4) == 0);
}
