#include <utility>

#include "check/warping.h"

// Apart from what measures: the library looks at frames, and reads no images.

namespace clarus::check {

Film Film::read(io::Sequence sequence, const std::function<void(size_t)>& done) {
    Film film;
    film.sequence = std::move(sequence);
    io::FrameReader reader(film.sequence, 0, film.sequence.frames.size(), true, false);
    while (auto frame = reader.next()) {
        film.add(std::move(frame->pixels));
        if (done) done(film.luma.size());
    }
    return film;
}

}  // namespace clarus::check
