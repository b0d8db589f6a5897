#pragma once

#include "clarus/types.h"

namespace clarus {

/// As options and files spell it.
inline const char* name_of(Precision precision) {
    switch (precision) {
        case Precision::fp32:
            return "fp32";
        case Precision::fp16:
            return "fp16";
        case Precision::bf16:
            return "bf16";
        case Precision::automatic:
            break;
    }
    return "auto";
}

}  // namespace clarus
