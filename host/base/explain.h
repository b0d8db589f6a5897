#pragma once

#include <exception>
#include <string>

namespace clarus {

/// What an exception says to a user. Of memory that ended and of threads that cannot begin, the C++ library's own words
/// do not tell what there is to do.
std::string explain(const std::exception& error);

}  // namespace clarus
