#include "cli/quality_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

namespace clarus::cli {
namespace {

using Sequence = metrics::SequenceQuality;

struct Figure {
    const char* key;
    const char* heading;
    int digits;
    bool most_is_best;
    std::optional<double> (*of)(const Sequence&);
};

constexpr std::array<Figure, 6> figures{
    {{"psnr", "PSNR (dB)", 2, true, [](const Sequence& q) { return std::optional(q.psnr); }},
     {"pooled_psnr", "pooled PSNR (dB)", 2, true, [](const Sequence& q) { return std::optional(q.pooled_psnr); }},
     {"ssim", "SSIM", 4, true, [](const Sequence& q) { return q.ssim; }},
     {"if_ssim", "IF-SSIM", 4, true, [](const Sequence& q) { return q.if_ssim; }},
     {"pixel_std", "pixel std", 2, false, [](const Sequence& q) { return q.pixel_std; }},
     {"flip", "FLIP", 4, false, [](const Sequence& q) { return q.flip; }}}};

void put(nlohmann::ordered_json& json, const char* key, const std::optional<double>& value) {
    if (value) json[key] = *value;
}

// As many columns as characters, for UTF-8 without wide ones.
size_t columns(const std::string& text) {
    return static_cast<size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

struct Column {
    std::string heading;
    std::vector<std::string> cells;
    std::string best;  // as printed, so that what looks the same is marked the same
    size_t width = 0;
};

Column column_of(const Figure& figure, std::span<const NamedQuality> results) {
    Column column{figure.heading, {}, {}, columns(figure.heading)};
    std::optional<double> best;
    for (const NamedQuality& result : results) {
        const auto value = figure.of(result.quality);
        column.cells.push_back(value ? fmt::format("{:.{}f}", *value, figure.digits) : "-");
        column.width = std::max(column.width, column.cells.back().size());
        if (!value || (best && (figure.most_is_best ? *value <= *best : *value >= *best))) continue;
        best = value;
        column.best = column.cells.back();
    }
    return column;
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char character : text) quoted += character == '"' ? "\"\"" : std::string(1, character);
    return quoted + '"';
}

}  // namespace

std::string to_text(const Sequence& quality) {
    std::string text = fmt::format("PSNR {:.2f} dB (pooled {:.2f} dB)", quality.psnr, quality.pooled_psnr);
    for (const Figure& figure : std::span(figures).subspan(2))
        if (const auto value = figure.of(quality))
            text += fmt::format(", {} {:.{}f}", figure.heading, *value, figure.digits);
    return text;
}

nlohmann::ordered_json quality_json(const metrics::FrameQuality& quality) {
    nlohmann::ordered_json json{{"psnr", quality.psnr}};
    put(json, "ssim", quality.ssim);
    put(json, "if_ssim", quality.if_ssim);
    put(json, "flip", quality.flip);
    return json;
}

nlohmann::ordered_json quality_json(const Sequence& quality) {
    nlohmann::ordered_json json;
    for (const Figure& figure : figures) put(json, figure.key, figure.of(quality));
    return json;
}

std::string quality_table(std::span<const NamedQuality> results, bool emphasise) {
    size_t name_width = 0;
    for (const NamedQuality& result : results) name_width = std::max(name_width, columns(result.name));
    std::vector<Column> table;
    for (const Figure& figure : figures)
        if (std::ranges::any_of(results, [&](const NamedQuality& r) { return figure.of(r.quality).has_value(); }))
            table.push_back(column_of(figure, results));

    std::string text(name_width, ' ');
    for (const Column& column : table) text += fmt::format("  {:>{}}", column.heading, column.width);
    for (size_t i = 0; i < results.size(); ++i) {
        text += "\n" + results[i].name + std::string(name_width - columns(results[i].name), ' ');
        for (const Column& column : table) {
            const std::string cell = fmt::format("{:>{}}", column.cells[i], column.width);
            text += emphasise && column.cells[i] == column.best ? "  \033[1m" + cell + "\033[0m" : "  " + cell;
        }
    }
    return text + "\n";
}

std::string quality_csv(std::span<const NamedQuality> results) {
    std::string text = "result";
    for (const Figure& figure : figures) text += fmt::format(",{}", figure.key);
    for (const NamedQuality& result : results) {
        text += "\r\n" + csv_field(result.name);
        for (const Figure& figure : figures) {
            const auto value = figure.of(result.quality);
            text += value ? fmt::format(",{}", *value) : ",";
        }
    }
    return text + "\r\n";
}

}  // namespace clarus::cli
