#include "clarus/jitter.h"

namespace clarus {
namespace {

double radical_inverse(int index, int base) {
    double value = 0, digit_weight = 1;
    for (; index > 0; index /= base) {
        digit_weight /= base;
        value += digit_weight * (index % base);
    }
    return value;
}

}  // namespace

Vec2 halton_jitter(int frame, int count) {
    const int index = frame % count + 1;
    return {static_cast<float>(radical_inverse(index, 2) - 0.5), static_cast<float>(radical_inverse(index, 3) - 0.5)};
}

}  // namespace clarus
