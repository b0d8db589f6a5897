#pragma once

#include <filesystem>
#include <string>

#include "io/onnx.h"

namespace clarus::io {

/// All that Clarus asks of the ONNX format's library, in a module that a build may be without.
class OnnxModule {
  public:
    /// The bytes of a file. Errors: file.
    virtual OnnxGraph parse(const std::string& bytes, const std::filesystem::path& path) const = 0;

  protected:
    ~OnnxModule() = default;
};

}  // namespace clarus::io
