#pragma once

#include <string>
#include <utility>
#include <vector>

#include "api/c/guard.h"
#include "clarus/clarus.h"
#include "clarus/device.h"
#include "clarus/model.h"

// What C's opaque pointers point to where more than one file needs to know.

struct clarus_device {
    explicit clarus_device(clarus::Device opened) : device(std::move(opened)), profiles(device.profiles()) {}
    clarus::Device device;
    std::vector<clarus::DeviceProfile> profiles;
};
struct clarus_model {
    clarus::Model model;
};
struct clarus_list {
    std::vector<std::string> words;
};

namespace clarus::c {

/// A list of the words that are returned.
clarus_status list_of(clarus_list** list, const auto& words) {
    return guarded([&] {
        clarus_list*& made = given(list, "the list");
        made = new clarus_list{words()};
    });
}

}  // namespace clarus::c
