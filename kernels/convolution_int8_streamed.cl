// Convolution in whole numbers for devices with few work-items and a small scratch memory: a work-item computes ROWS
// rows of WIDTH output pixels, one row after the other. A ring in local memory holds the numbers of the rows of input
// that a row of output needs, and of one more, which is fetched meanwhile by async_work_group_copy where the input is
// stored as numbers. Products are of 16 bits, sums of 32; PIXELS pixels of sixteen output channels are summed at once.
//
// Options: CIN, COUT, KERNEL (odd), WIDTH, ROWS, PIXELS, WG_X, WG_Y (both 1), and those of convolution_int8.clh.
// Work-items: (⌈height / ROWS⌉, ⌈width / WIDTH⌉). Packed biases are without what the zero point adds; weights are
// [block][tap][input channel][16] bytes.

#include "convolution_int8.clh"

#define CHANNELS ((CIN + 3) / 4 * 4)
#if defined(INPUT_BYTES)
#define PIXEL_BYTES PART0_STRIDE
#else
#define PIXEL_BYTES CHANNELS
#endif
#define TAPS (KERNEL * KERNEL)
// What is beyond the tile is there for the last pixels that are summed at once.
#define PATCH_WIDTH (WIDTH + KERNEL - 1 + PIXELS)
#define LINE (PATCH_WIDTH * PIXEL_BYTES)
#define RING (KERNEL + 1)

INLINE void fill(local uchar* to, int bytes, uchar value) {
    for (int i = 0; i < bytes; ++i) to[i] = value;
}

// Begins to fetch row y of the input, from pixel x on; what is outside is the zero point. `fetched` are the fetches
// that have begun and were not waited for.
INLINE void fetch(INPUT_PARAMETERS int x, int y, float inverse_scale, int zero_point, local uchar* line,
                  event_t* fetched, int* begun) {
    const int first = max(0, -x), end = min(WIDTH + KERNEL - 1, IN_WIDTH - x);
    if (y < 0 || y >= IN_HEIGHT || first >= end) {
        fill(line, LINE, zero_point);
        return;
    }
    fill(line, first * PIXEL_BYTES, zero_point);
    fill(line + end * PIXEL_BYTES, LINE - end * PIXEL_BYTES, zero_point);
#ifdef INPUT_BYTES
    // Without what may follow the last pixel's channels.
    event_t before = 0;
    if (*begun) before = *fetched;
    *fetched = async_work_group_copy(line + first * PIXEL_BYTES, in0 + AT(PART0, x + first, y, 0),
                                     (end - first - 1) * PIXEL_BYTES + CIN, before);
    *begun = 1;
#else
    for (int p = first; p < end; ++p) {
        local uchar* to = line + p * PIXEL_BYTES;
#define FETCH_PART(P) \
    for (int c = 0; c < PART##P##_CHANNELS; c += 4) vstore4(NUMBER_4(P, x + p, y, c), 0, to + PART##P##_FIRST + c);
        EACH_PART(FETCH_PART)
    }
#endif
}

// PIXELS pixels of a block of output channels. Row ky of the patch begins at lines[ky].
INLINE void convolve(const Sizes* sizes, local const uchar* const* lines, int p, int block, int last_x, int x, int y,
                     global const int* packed, global result_storage* out) {
    int16 sum[PIXELS];
#pragma unroll
    for (int i = 0; i < PIXELS; ++i) sum[i] = vload16(block, BIASES(packed));
    global const char* weights = (global const char*)WEIGHTS(packed) + block * 16 * TAPS * CIN;
    for (int ky = 0; ky < KERNEL; ++ky)
        for (int kx = 0; kx < KERNEL; ++kx) {
            local const uchar* numbers = lines[ky] + (p + kx) * PIXEL_BYTES;
            for (int c = 0; c < CIN; ++c, weights += 16) {
                const short16 weight = convert_short16(vload16(0, weights));
#pragma unroll
                for (int i = 0; i < PIXELS; ++i) sum[i] += convert_int16(weight * (short)numbers[i * PIXEL_BYTES + c]);
            }
        }
#pragma unroll
    for (int i = 0; i < PIXELS; ++i)
        if (x + i < last_x) store_sums(sum[i], block, packed, out, AT(OUT, x + i, y, 16 * block));
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const int* restrict packed_sets, global result_storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local uchar ring[RING * LINE];
    const int x = (int)get_global_id(1) * WIDTH, y = ROW_ITEM(0) * ROWS;
    const int last_x = min(x + WIDTH, OUT_WIDTH), last_y = min(y + ROWS, OUT_HEIGHT);
    global const int* packed = packed_sets + packed_offset;
    const float inverse_scale = HEAD_INVERSE_SCALE(packed);
    const int zero_point = HEAD_ZERO_POINT(packed);
    const int left = x - KERNEL / 2, top = y - KERNEL / 2;
#define RING_LINE(row) (ring + ((row)-top) % RING * LINE)
#define FETCH(row) fetch(INPUT left, row, inverse_scale, zero_point, RING_LINE(row), &fetched, &begun)
    event_t fetched = 0;
    int begun = 0;
    for (int row = top; row < top + KERNEL; ++row) FETCH(row);
    for (int row = y; row < last_y; ++row) {
        if (begun) wait_group_events(1, &fetched);
        barrier(CLK_LOCAL_MEM_FENCE);
        begun = 0;
        if (row + 1 < last_y) FETCH(row + KERNEL / 2 + 1);
        local const uchar* lines[KERNEL];
        for (int ky = 0; ky < KERNEL; ++ky) lines[ky] = RING_LINE(row - KERNEL / 2 + ky);
        for (int block = 0; block < OUT_BLOCKS; ++block)
            for (int p = 0; x + p < last_x; p += PIXELS)
                convolve(sizes, lines, p, block, last_x, x + p, row, packed, out);
    }
}
