#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "io/file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Runs a target over the files of folders, without libFuzzer: inputs that once failed are tests. A folder that is
/// missing has none; no input at all is a failure.
int main(int count, char** folders) {
    size_t inputs = 0;
    for (int i = 1; i < count; ++i) {
        if (!std::filesystem::exists(folders[i])) continue;
        for (const auto& entry : std::filesystem::directory_iterator(folders[i])) {
            std::printf("%s\n", entry.path().c_str());
            std::fflush(stdout);
            const std::string bytes = clarus::io::read_file(entry.path());
            LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
            ++inputs;
        }
    }
    std::printf("%zu inputs\n", inputs);
    return inputs ? 0 : 1;
}
