#include <clarus/model.h>
#include <clarus/version.h>

#include <cstdio>

/// Whether the package's library and models are found.
int main() {
    const clarus::Model model = clarus::Model::find("enss-s-x2");
    std::printf("clarus %s: %s, x%g\n", clarus_version_string(), model.name().c_str(), model.scale());
    return 0;
}
