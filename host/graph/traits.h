#pragma once

#include <concepts>
#include <cstddef>

namespace clarus::graph {

class Graph;
struct Node;

/// Whose memory an operator's result is in, and what writes it there.
enum class Memory {
    own,       // memory of its own, written by a kernel
    in_place,  // that of its first input, which a kernel changes and nothing else reads afterwards
    ingested,  // memory of its own, written before the frame's first kernel runs
    imported,  // memory that is handed in, with what another part of the network has made; no kernel
    gathers,   // memory of its own, in which its inputs are made; no kernel
    aliases,   // that of its first input; no kernel
    previous,  // that of a state's value in the frame before; no kernel
};

/// The type of a result's elements.
enum class Stored {
    f32,       // float: motion, depth and what is made of them alone
    image,     // the type that images are stored in
    feature,   // as `image`; convolutions can also read it as one of several images that their input is made of
    bytes,     // whole numbers from 0 to 255 that stand for others (Quantization); convolutions alone read them
    as_input,  // that of the memory it shares
};

/// Which pixels of an image are stored. Those that read one kind can read the kinds before it.
enum class Pixels {
    all,
    samples,  // one in each square of scale × scale pixels; the others are 0
    tiles,    // one for each such square, all of whose pixels it is
};

/// How images that share memory lie in it: the result in its input's where it aliases that, an input in the result's
/// where that gathers.
struct Placement {
    int channel = 0;              // of the memory's, where the image's first is
    int block = 1;                // a pixel of the memory holds a square of block × block of the image's
    int scale = 1;                // pixels of the image along each side of a square of which one is stored
    Pixels pixels = Pixels::all;  // which
};

/// Rows [first, end) of an image.
struct Rows {
    int first, end;
};

/// The rows of input `position` that rows of a node's result are made of. They may reach beyond the input, whose first
/// and last rows are then meant.
using RowsRead = Rows (*)(const Graph& graph, const Node& node, size_t position, Rows rows);
inline constexpr RowsRead kAnyRows = nullptr;  // anywhere in the input: no bands
Rows same_rows(const Graph& graph, const Node& node, size_t position, Rows rows);
Rows rows_of_pooling(const Graph& graph, const Node& node, size_t position, Rows rows);
Rows rows_of_upsampling(const Graph& graph, const Node& node, size_t position, Rows rows);
Rows rows_of_squares(const Graph& graph, const Node& node, size_t position, Rows rows);
Rows rows_of_convolution(const Graph& graph, const Node& node, size_t position, Rows rows);

/// Floating-point operations of the plain definition (a product, a sum, a comparison, a root are one each): so many for
/// each element of the result, or what a function says of the whole. Where they depend on the image, those of the usual
/// case.
class Cost {
  public:
    using Function = double (*)(const Graph& graph, const Node& node);
    constexpr Cost(double an_element) : an_element_(an_element) {}
    constexpr Cost(int an_element) : an_element_(an_element) {}
    constexpr Cost(Function of_all) : of_all_(of_all) {}
    double of(const Graph& graph, const Node& node) const;

  private:
    double an_element_ = 0;
    Function of_all_ = nullptr;
};
double operations_of_convolution(const Graph& graph, const Node& node);
double operations_of_fit(const Graph& graph, const Node& node);

/// What passes and plans must know of an operator. Each has a member traits() that says it, all but the placement being
/// required: one that lacks them does not compile.
struct Traits {
    Memory memory;
    Stored stored;
    Pixels reads;   // the kinds of images that it can read; of others, a copy comes between
    RowsRead rows;  // kAnyRows, or it can work on bands of rows
    Cost cost;
    Placement placement = {};
};

template <typename Op>
concept HasTraits = requires(const Op& op) {
    { op.traits() } -> std::same_as<Traits>;
};

}  // namespace clarus::graph
