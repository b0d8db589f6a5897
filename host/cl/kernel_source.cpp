#include "cl/kernel_source.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "base/error.h"
#include "kernel_sources.h"

namespace clarus::ocl {

std::string_view kernel_file(std::string_view name) {
    for (const KernelFile& file : kernel_files())
        if (file.name == name) return file.text;
    fail(ErrorKind::invalid_argument, "there is no kernel file '{}'", name);
}

namespace {

std::string_view take_line(std::string_view& text) {
    const size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end);
    return line;
}

/// `text` with the files that its lines `#include "…"` name in their places. The #line directives make the compiler's
/// messages name the file that a person can open.
std::string with_included(std::string_view name, std::string_view text) {
    constexpr std::string_view kInclude = "#include \"";
    std::string result = fmt::format("#line 1 \"{}\"\n", name);
    for (int line = 1; !text.empty(); ++line) {
        const std::string_view each = take_line(text);
        if (!each.starts_with(kInclude)) {
            result += each;
            continue;
        }
        const std::string_view included = each.substr(kInclude.size(), each.rfind('"') - kInclude.size());
        result += fmt::format("{}\n#line {} \"{}\"\n", with_included(included, kernel_file(included)), line + 1, name);
    }
    return result + '\n';
}

bool in_identifier(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

std::string_view identifier_before(std::string_view text, size_t end) {
    while (end > 0 && text[end - 1] == ' ') --end;
    size_t begin = end;
    while (begin > 0 && in_identifier(text[begin - 1])) --begin;
    return text.substr(begin, end - begin);
}

std::string_view identifier_at(std::string_view text, size_t begin) {
    size_t end = begin;
    while (end < text.size() && in_identifier(text[end])) ++end;
    return text.substr(begin, end - begin);
}

bool is_type(std::string_view word) {
    while (!word.empty() && std::isdigit(static_cast<unsigned char>(word.back()))) word.remove_suffix(1);
    return word == "float" || word == "half" || word == "int" || word == "uint";
}

/// What a unit defines.
struct Names {
    std::set<std::string_view> whole;     // functions and types
    std::set<std::string_view> prefixes;  // of functions that a macro pastes together
    std::set<std::string_view> macros;
};

/// Reads the house's own style: definitions begin their lines.
Names defined_in(std::string_view text) {
    constexpr std::string_view kFunctions[] = {"INLINE ", "OUTLINE ", "inline ", "kernel "};
    Names names;
    while (!text.empty()) {
        std::string_view line = take_line(text);
        const bool indented = line.starts_with(' ');
        line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
        if (line.starts_with("#define ")) {
            names.macros.insert(identifier_at(line, 8));
        } else if (std::any_of(std::begin(kFunctions), std::end(kFunctions),
                               [&](std::string_view word) { return line.starts_with(word); })) {
            const size_t of_kernel = line.starts_with("kernel ") ? line.find(" void ") : line.npos;
            if (of_kernel != line.npos) {
                names.whole.insert(identifier_at(line, of_kernel + 6));
            } else if (const size_t pasted = std::min(line.find("##"), line.find('(')); pasted != line.npos) {
                (line[pasted] == '#' ? names.prefixes : names.whole).insert(identifier_before(line, pasted));
            }
        } else if (!indented && (line.starts_with("} ") || line.starts_with("typedef ")) &&
                   line.find('{') == line.npos && line.find(';') != line.npos) {
            names.whole.insert(identifier_before(line, line.find(';')));
        } else if (!indented && line.starts_with("DEFINE_")) {
            // A macro that defines a function of the name that it is given.
            for (size_t i = line.find('('); i < line.size(); ++i)
                if (const auto word = identifier_at(line, i); !word.empty()) {
                    if (std::islower(static_cast<unsigned char>(word.front())) && !is_type(word))
                        names.whole.insert(word);
                    i += word.size();
                }
        }
    }
    return names;
}

/// The unit's text with its own names in place of those that it defines.
std::string renamed(std::string_view text, const Names& names, size_t unit) {
    std::string result;
    result.reserve(text.size() + text.size() / 8);
    for (size_t i = 0; i < text.size();) {
        const std::string_view word = identifier_at(text, i);
        if (word.empty()) {
            result += text[i++];
            continue;
        }
        i += word.size();
        if (names.whole.contains(word)) {
            result += name_in_unit(word, unit);
            continue;
        }
        const auto prefix = std::find_if(names.prefixes.begin(), names.prefixes.end(),
                                         [&](std::string_view each) { return word.starts_with(each); });
        const bool pasted = prefix != names.prefixes.end() && (word.size() > prefix->size() || text[i] == '#');
        result += pasted ? fmt::format("{}_{}", name_in_unit(*prefix, unit), word.substr(prefix->size())) : word;
    }
    return result;
}

std::vector<std::string_view> definitions(std::string_view options) {
    std::vector<std::string_view> result;
    while (!options.empty()) {
        const size_t begin = std::min(options.find("-D"), options.size());
        options.remove_prefix(begin);
        if (options.empty()) break;
        options.remove_prefix(2);
        const size_t end = std::min(options.find(' '), options.size());
        result.push_back(options.substr(0, end));
        options.remove_prefix(end);
    }
    return result;
}

}  // namespace

std::string name_in_unit(std::string_view name, size_t unit) {
    return unit == 0 ? std::string(name) : fmt::format("{}_{}", name, unit);
}

std::string program_text(std::span<const ProgramUnit> units) {
    std::string result = with_included("common.clh", kernel_file("common.clh"));
    for (size_t i = 0; i < units.size(); ++i) {
        const std::string text =
            with_included("unit.clh", kernel_file("unit.clh")) + with_included(units[i].name, units[i].source);
        Names names = defined_in(text);
        result += fmt::format("#line 1 \"the options of {}\"\n", units[i].name);
        for (const std::string_view definition : definitions(units[i].options)) {
            const size_t value = std::min(definition.find('='), definition.size());
            const std::string_view name = definition.substr(0, value);
            result +=
                fmt::format("#define {} {}\n", name, value < definition.size() ? definition.substr(value + 1) : "1");
            names.macros.insert(name);
        }
        result += renamed(text, names, i);
        for (const std::string_view macro : names.macros) result += fmt::format("#undef {}\n", macro);
    }
    return result;
}

}  // namespace clarus::ocl
