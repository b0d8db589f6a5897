#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "graph/graph.h"

namespace clarus::runtime {

enum class Storage { f32, f16, u8 };

inline size_t bytes_of(Storage storage) { return storage == Storage::u8 ? 1 : storage == Storage::f16 ? 2 : 4; }

/// Where a value's elements lie (kernels/common.clh): a grid of cells, each holding a block × block square of pixels.
/// With it, concat, slice, space-to-depth and depth-to-space are views of one block of memory. So is zero-upsampling:
/// `samples` times fewer columns and rows are stored, the samples of a frame; every other pixel is 0. Of an image that
/// is `tiled`, all pixels of a tile of samples × samples are the one that is stored.
struct TensorLayout {
    int memory = -1;  // index into LayoutPlan::memories
    Storage storage = Storage::f32;
    int width = 0, height = 0, channels = 0;
    int block = 1;
    int stride = 0;  // elements from cell to cell
    int offset = 0;  // elements from a cell's start to channel 0
    int samples = 1;
    bool tiled = false;
    bool previous_samples = false;  // the samples are the frame before's
    int ring = 0;                   // where not all rows of cells are kept: how many, each in the place of row % ring
    bool in_ring = false;           // kernels are compiled for a ring of rows, even where it holds all of them

    int row() const { return (width / samples + block - 1) / block * stride; }
    int rows() const { return ring > 0 ? ring : (height / samples + block - 1) / block; }
    friend bool operator==(const TensorLayout&, const TensorLayout&) = default;
};

/// Bytes of the memory that a layout which is not a part of another's needs, slack for vector loads included.
size_t memory_bytes(const TensorLayout& layout);

/// What of a layout a kernel is told when it runs: struct Tensor of kernels/common.clh, member by member.
struct TensorArgument {
    std::int32_t width, height;  // of the image, in pixels
    std::int32_t row;            // elements from row to row of the stored grid
    std::int32_t offset;         // elements from a cell's start to channel 0
    std::int32_t ring;           // rows that are kept; 0: all
    std::uint32_t
        reciprocal;  // 2^32 / ring, rounded up past it: row − mul_hi(row, reciprocal) · ring is row modulo ring
};
static_assert(sizeof(TensorArgument) == 24);
TensorArgument argument_for(const TensorLayout& layout);

/// All of it but which memory it is: the same where the bytes mean the same.
std::string text_of(const TensorLayout& layout);

/// What a kernel is compiled for: "-DIN_CHANNELS=… -DIN_BLOCK=… …" for name "IN", all that kernels/common.clh asks for,
/// with the names of what it is told when it runs ("-DIN_WIDTH=sizes->IN.width").
std::string layout_options(const std::string& name, const TensorLayout& layout);

struct Memory {
    size_t bytes = 0;        // with what pads cells and the end
    size_t values = 0;       // bytes of the values alone
    int state = -1;          // index into Graph::states where it holds this frame's value of one, else −1
    bool previous = false;   // holds last frame's value of that state
    bool handed_in = false;  // of an import or an export: whoever runs the plan hands it in
};

/// Every value's layout. `graph` is the given one with copies put in where a value that concat or space-to-depth wants
/// in its own memory cannot be written there by what makes it.
struct LayoutPlan {
    graph::Graph graph;
    std::vector<TensorLayout> layouts;  // one a node
    std::vector<Memory> memories;
};

/// `storage` holds for images and features; depth, motion and what is made of them alone stay in f32. The output and
/// views are stored whole: none may show a zero-upsampled image.
LayoutPlan lay_out(const graph::Graph& graph, Storage storage);

/// Errors: invalid_argument where a memory has more elements than a kernel can count.
void check_sizes(const LayoutPlan& plan);

}  // namespace clarus::runtime
