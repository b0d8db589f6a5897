#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

namespace clarus::render {

/// Turned by these angles around x, y and z.
template <typename T>
Imath::Matrix44<T> turn(const Imath::Vec3<T>& angles) {
    Imath::Matrix44<T> matrix;
    matrix.rotate(angles);
    return matrix;
}

template <typename T>
Imath::Matrix44<T> move(const Imath::Vec3<T>& by) {
    Imath::Matrix44<T> matrix;
    matrix.setTranslation(by);
    return matrix;
}

/// Turned, then moved.
template <typename T>
Imath::Matrix44<T> placed(const Imath::Vec3<T>& angles, const Imath::Vec3<T>& at) {
    return turn(angles) * move(at);
}

}  // namespace clarus::render
