#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <random>
#include <string>

#include "io/image.h"
#include "io/sequence.h"

namespace clarus::test {

inline io::Pixels noise(Size size, int channels, float low, float high, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> distribution(low, high);
    io::Pixels pixels{size, channels, {}};
    pixels.values.resize(static_cast<size_t>(size.width) * size.height * channels);
    for (float& value : pixels.values) value = distribution(random);
    return pixels;
}

/// A sequence of noise for ×2, written as a renderer would write one.
inline void write_noise_sequence(const std::filesystem::path& folder, Size render_size, int frame_count,
                                 ColorSpace color_space = ColorSpace::srgb) {
    const bool linear = color_space == ColorSpace::linear;
    io::Sequence description;
    description.folder = folder;
    description.render_size = render_size;
    description.color_space = color_space;
    description.mip_bias = -1;
    for (const char* name : {"color", "depth", "motion", "reference"})
        std::filesystem::create_directories(folder / name);
    for (int i = 0; i < frame_count; ++i) {
        const std::string name = fmt::format("{:04}", i);
        const auto path = [&](const char* kind, const char* extension) { return folder / kind / (name + extension); };
        const char* extension = linear ? ".exr" : ".png";
        const io::SampleType type = linear ? io::SampleType::f32 : io::SampleType::u8;
        const float brightest = linear ? 5.0f : 1.0f;
        io::FrameFiles frame;
        frame.color = path("color", extension);
        frame.depth = path("depth", ".exr");
        frame.motion = path("motion", ".exr");
        frame.reference = path("reference", extension);
        frame.reset = i == 0;
        frame.name = name;
        io::write_image(frame.color, noise(render_size, 3, 0, brightest, 4 * i), type);
        io::write_image(frame.depth, noise(render_size, 1, 0, 1, 4 * i + 1), io::SampleType::f32);
        io::write_image(frame.motion, noise(render_size, 2, -2, 2, 4 * i + 2), io::SampleType::f32);
        io::write_image(frame.reference, noise(description.output_size(), 3, 0, brightest, 4 * i + 3), type);
        description.frames.push_back(frame);
    }
    io::write_sequence(description, folder);
}

}  // namespace clarus::test
