// collect(colour, past, t, M, s, J) of docs/fsr2.md for any real s: a pixel's new history, the weighted mean of what the
// frame's samples around it show and of what was there before, as far as that is believed.
//
// Options: COLOR_*, TRUST_* (render resolution), PAST_*, OUT_* (output resolution; layouts of one storage), MOTION_*
// (output resolution, float), SCALE, SCALE_REST (s as the sum of two floats), STORE_HALF.

#define SHARP (3 * SCALE * SCALE)  // samples weigh 2^(-SHARP d²) at a distance of d render pixels
#define SOFT 5.0f                  // and by 2^(-SOFT d²) where there is no history
#define SHARE 0.003f               // of the soft weights with history: for a pixel that no sample is near to
#define TIGHT 1.0f                 // deviations of the samples that history may be from their mean without trust
#define LOOSE 20.0f                // with all trust
#define EXCESS 0.001f
#define MOST 12.0f        // weight of a history that stands still
#define MOST_MOVING 0.6f  // of one that moves by an output pixel or more

#define LESSER(a, b) ((a) < (b) ? (a) : (b))
#define GREATER(a, b) ((a) > (b) ? (a) : (b))

// Samples along an axis: the nearest one, and what it and those before and after weigh.
typedef struct {
    int sample;
    float sharp[3], soft[3];
} Weights;

INLINE Weights weights_at(int x, float jitter, int size) {
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, jitter);
    const int sample = clamp(u.whole + (u.fraction >= 0.5f), 0, size - 1);
    const float offset = (u.whole - sample) + u.fraction;
    Weights weights;
    weights.sample = sample;
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        const float distance = (i - 1) - offset, squared = distance * distance;
        weights.sharp[i] = exp2_float(GREATER(-SHARP * squared, -120.0f));
        weights.soft[i] = exp2_float(GREATER(-SOFT * squared, -120.0f));
    }
    return weights;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void collect(global const storage* color,
                                                                         global const storage* past,
                                                                         global const storage* trust,
                                                                         global const float* motion,
                                                                         global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Weights across = weights_at(x, frame.jitter_x, COLOR_WIDTH);
    const Weights down = weights_at(y, frame.jitter_y, COLOR_HEIGHT);
    float4 mean = 0, square = 0, sharp = 0, soft = 0;
    float sharp_weight = 0, soft_weight = 0;
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const int column = clamp(across.sample + i % 3 - 1, 0, COLOR_WIDTH - 1);
        const int row = clamp(down.sample + i / 3 - 1, 0, COLOR_HEIGHT - 1);
        const float4 sample = to_ycocg(LOAD_CHANNELS(COLOR, color, column, row, 0));
        const float by_sharp = across.sharp[i % 3] * down.sharp[i / 3];
        const float by_soft = across.soft[i % 3] * down.soft[i / 3];
        mean += sample;
        square += sample * sample;
        sharp += by_sharp * sample;
        soft += by_soft * sample;
        sharp_weight += by_sharp;
        soft_weight += by_soft;
    }
    const float4 history = LOAD_CHANNELS(PAST, past, x, y, 0);
    const float fresh = sharp_weight + SHARE * soft_weight;
    float4 result = soft / soft_weight;
    float weight = fresh;
    if (history.w > 0) {
        mean /= 9;
        const float4 deviation = sqrt(fmax(square / 9 - mean * mean, 0.0f));
        const float believed = LOAD(trust, AT(TRUST, across.sample, down.sample, 0));
        const float4 reach = (TIGHT + (LOOSE - TIGHT) * believed) * deviation;
        const float4 before = to_ycocg(history), confined = fmin(fmax(before, mean - reach), mean + reach);
        const float4 excess = confined - before;
        const float moved = excess.x * excess.x + excess.y * excess.y + excess.z * excess.z;
        const float room = EXCESS + reach.x * reach.x + reach.y * reach.y + reach.z * reach.z;
        const float motion_x = motion[AT(MOTION, x, y, 0)], motion_y = motion[AT(MOTION, x, y, 1)];
        const float speed = LESSER(sqrt(motion_x * motion_x + motion_y * motion_y), 1.0f);
        const float most = MOST + (MOST_MOVING - MOST) * speed;
        const float kept = LESSER(believed * history.w, most) * room / (room + moved);
        weight = kept + fresh;
        result = confined + (sharp + SHARE * soft - fresh * confined) / weight;
        weight = LESSER(weight, MOST);
    }
    const float3 shown =
        (float3)(result.x + result.y - result.z, result.x + result.z, result.x - result.y - result.z);
    STORE_CHANNELS(OUT, (float4)(clamp(shown, 0.0f, 1.0f), weight), out, x, y, 0);
}
