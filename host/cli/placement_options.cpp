#include "cli/placement_options.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "base/error.h"

namespace clarus::cli {

std::string placement_rules(const std::string& given) {
    std::error_code too_long_for_a_name;
    if (!std::filesystem::is_regular_file(given, too_long_for_a_name)) return given;
    std::ifstream file(given);
    std::string rules, line;
    while (std::getline(file, line)) rules += line.substr(0, line.find('#')) + ",";
    if (file.bad()) fail(ErrorKind::file, "{} cannot be read", given);
    if (rules.find('=') == rules.npos)
        fail(ErrorKind::file, "{} has no rule; write one a line, such as 'reconstruct.*=dsp'", given);
    return rules;
}

void add_placement_options(CLI::App& command, StreamOptions& options) {
    options.placement = "auto";
    command
        .add_option_function<std::string>(
            "--place", [&options](const std::string& given) { options.placement = placement_rules(given); },
            "With several devices, what each makes: auto, which measures; rules, PATTERN=DEVICE, between commas, "
            "of stages' names (upscale --profile) and devices' classes or numbers from 0; or a file of them")
        ->type_name("RULES")
        ->default_str("auto");
    command.add_flag("--fallback", options.fallback,
                     "With several devices: where one fails, the others go on with what it made, without history");
}

}  // namespace clarus::cli
