#include "cli/quality_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "metrics/psnr.h"

namespace clarus::cli {
namespace {

using Sequence = metrics::SequenceQuality;
using Frame = metrics::FrameQuality;
using Value = std::optional<double>;

enum class Table { whole, psnr_in_places, ssim_in_places, none };
enum class Best { most, least, nearest_to_one };

struct Figure {
    std::string key, heading;
    int digits;
    Best best;
    Table table;
    std::function<Value(const Sequence&)> of;
    std::function<Value(const Frame&)> of_frame;  // none where it is of sequences alone
    double shown_factor = 1;
};

constexpr std::array<const char*, metrics::region_count> region_headings{"disoccl. 1", "disoccl. 4", "disoccl. 8",
                                                                         "thin",       "moving",     "still"};

template <typename Quality>
std::function<Value(const Quality&)> region_psnr(size_t region) {
    return [region](const Quality& quality) {
        return quality.regions[region] ? Value(quality.regions[region]->psnr) : std::nullopt;
    };
}

template <typename Quality>
std::function<Value(const Quality&)> region_ssim(size_t region) {
    return [region](const Quality& quality) {
        return quality.regions[region] ? quality.regions[region]->ssim : std::nullopt;
    };
}

// Of either kind of quality, where it is of linear radiance.
template <typename Of>
auto of_radiance(Of of) {
    return [of](const auto& quality) {
        return quality.radiance ? Value(std::invoke(of, *quality.radiance)) : std::nullopt;
    };
}

std::vector<Figure> make_figures() {
    using Radiance = metrics::RadianceQuality;
    const auto mean_ratio = of_radiance(&Radiance::mean_ratio);
    const auto relative_error = of_radiance(&Radiance::relative_error);
    const auto pq_psnr = of_radiance(&Radiance::pq_psnr);
    std::vector<Figure> figures{
        {"psnr", "PSNR (dB)", 2, Best::most, Table::whole, &Sequence::psnr, &Frame::psnr},
        {"pooled_psnr", "pooled PSNR (dB)", 2, Best::most, Table::whole, &Sequence::pooled_psnr, {}},
        {"ssim", "SSIM", 4, Best::most, Table::whole, &Sequence::ssim, &Frame::ssim},
        {"if_ssim", "IF-SSIM", 4, Best::most, Table::whole, &Sequence::if_ssim, &Frame::if_ssim},
        {"pixel_std", "pixel std", 2, Best::least, Table::whole, &Sequence::pixel_std, {}},
        {"flip", "FLIP", 4, Best::least, Table::whole, &Sequence::flip, &Frame::flip},
        {"lpips", "LPIPS", 4, Best::least, Table::whole, &Sequence::lpips, &Frame::lpips},
        {"vmaf", "VMAF", 2, Best::most, Table::whole, &Sequence::vmaf, &Frame::vmaf},
        {"strred", "STRRED", 2, Best::least, Table::whole, &Sequence::strred, {}},
        {"srred", "SRRED", 4, Best::least, Table::none, &Sequence::srred, &Frame::srred},
        {"trred", "TRRED", 4, Best::least, Table::none, &Sequence::trred, &Frame::trred},
        {"mean_ratio", "mean ratio", 4, Best::nearest_to_one, Table::whole, mean_ratio, mean_ratio},
        {"relative_error", "relative error", 4, Best::least, Table::whole, relative_error, relative_error},
        {"pq_psnr", "PQ PSNR (dB)", 2, Best::most, Table::whole, pq_psnr, pq_psnr}};
    for (size_t i = 0; i < metrics::region_count; ++i)
        figures.push_back({fmt::format("{}_psnr", metrics::region_names[i]), region_headings[i], 2, Best::most,
                           Table::psnr_in_places, region_psnr<Sequence>(i), region_psnr<Frame>(i)});
    const auto worst_of_frame = [](const Frame& frame) -> Value {
        if (frame.blocks.mean_squared_errors.empty()) return std::nullopt;
        return metrics::psnr(metrics::worst_hundredth(frame.blocks.mean_squared_errors));
    };
    figures.push_back({"worst_blocks_psnr", "worst 1 %", 2, Best::most, Table::psnr_in_places,
                       &Sequence::worst_blocks_psnr, worst_of_frame});
    figures.push_back({"worse_blocks", "worse blocks (%)", 1, Best::least, Table::psnr_in_places,
                       &Sequence::worse_blocks, &Frame::worse_blocks, 100});
    figures.push_back({"worse_blocks_moving",
                       "moving (%)",
                       1,
                       Best::least,
                       Table::psnr_in_places,
                       &Sequence::worse_blocks_moving,
                       {},
                       100});
    for (size_t i = 0; i < metrics::region_count; ++i)
        figures.push_back({fmt::format("{}_ssim", metrics::region_names[i]), region_headings[i], 4, Best::most,
                           Table::ssim_in_places, region_ssim<Sequence>(i), region_ssim<Frame>(i)});
    return figures;
}

const std::vector<Figure>& all_figures() {
    static const std::vector<Figure> figures = make_figures();
    return figures;
}

bool is_better(const Figure& figure, double value, double than) {
    if (figure.best == Best::nearest_to_one) return std::abs(value - 1) < std::abs(than - 1);
    return figure.best == Best::most ? value > than : value < than;
}

void put(nlohmann::ordered_json& json, const std::string& key, const Value& value) {
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
        column.cells.push_back(value ? fmt::format("{:.{}f}", *value * figure.shown_factor, figure.digits) : "-");
        column.width = std::max(column.width, column.cells.back().size());
        if (!value || (best && !is_better(figure, *value, *best))) continue;
        best = value;
        column.best = column.cells.back();
    }
    return column;
}

/// Nothing where no result has any of the figures.
std::string table_of(Table kind, std::span<const NamedQuality> results, bool emphasise) {
    size_t name_width = 0;
    for (const NamedQuality& result : results) name_width = std::max(name_width, columns(result.name));
    std::vector<Column> table;
    for (const Figure& figure : all_figures())
        if (figure.table == kind &&
            std::ranges::any_of(results, [&](const NamedQuality& r) { return figure.of(r.quality).has_value(); }))
            table.push_back(column_of(figure, results));
    if (table.empty()) return {};

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

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char character : text) quoted += character == '"' ? "\"\"" : std::string(1, character);
    return quoted + '"';
}

}  // namespace

std::string to_text(const Sequence& quality) {
    std::string text = fmt::format("PSNR {:.2f} dB (pooled {:.2f} dB)", quality.psnr, quality.pooled_psnr);
    for (const Figure& figure : std::span(all_figures()).subspan(2)) {
        if (figure.table != Table::whole) continue;
        if (const auto value = figure.of(quality))
            text += fmt::format(", {} {:.{}f}", figure.heading, *value, figure.digits);
    }
    return text;
}

nlohmann::ordered_json quality_json(const Frame& quality) {
    nlohmann::ordered_json json;
    for (const Figure& figure : all_figures())
        if (figure.of_frame) put(json, figure.key, figure.of_frame(quality));
    if (quality.moves) json["moves"] = true;
    return json;
}

nlohmann::ordered_json quality_json(const Sequence& quality) {
    nlohmann::ordered_json json;
    for (const Figure& figure : all_figures()) put(json, figure.key, figure.of(quality));
    return json;
}

std::string quality_table(std::span<const NamedQuality> results, bool emphasise) {
    return table_of(Table::whole, results, emphasise);
}

std::string places_tables(std::span<const NamedQuality> results, bool emphasise) {
    const std::string psnr = table_of(Table::psnr_in_places, results, emphasise);
    const std::string ssim = table_of(Table::ssim_in_places, results, emphasise);
    const bool has_baseline = std::ranges::any_of(
        results, [](const NamedQuality& result) { return result.quality.worse_blocks.has_value(); });
    const std::string heading =
        fmt::format("\nPSNR (dB) in places{}\n", has_baseline ? "; blocks worse than the baseline's" : "");
    return (psnr.empty() ? "" : heading + psnr) + (ssim.empty() ? "" : "\nSSIM in places\n" + ssim);
}

std::string quality_csv(std::span<const NamedQuality> results) {
    std::string text = "result";
    for (const Figure& figure : all_figures()) text += fmt::format(",{}", figure.key);
    for (const NamedQuality& result : results) {
        text += "\r\n" + csv_field(result.name);
        for (const Figure& figure : all_figures()) {
            const auto value = figure.of(result.quality);
            text += value ? fmt::format(",{}", *value) : ",";
        }
    }
    return text + "\r\n";
}

}  // namespace clarus::cli
