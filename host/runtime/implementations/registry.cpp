#include "runtime/implementation.h"

namespace clarus::runtime {
namespace {

struct ByOperator {
    std::span<const Implementation> operator()(const graph::Convolution& convolution) const {
        return convolution.rounds ? quantized_convolution_implementations() : convolution_implementations();
    }
    std::span<const Implementation> operator()(const graph::Upsample&) const { return upsample_implementations(); }
    std::span<const Implementation> operator()(const graph::UpsampleMotion&) const {
        return upsample_motion_implementations();
    }
    std::span<const Implementation> operator()(const graph::Resample&) const { return resample_implementations(); }
    std::span<const Implementation> operator()(const graph::Fit&) const { return fit_implementations(); }
    std::span<const Implementation> operator()(const graph::Easu&) const { return easu_implementations(); }
    std::span<const Implementation> operator()(const graph::Rcas&) const { return rcas_implementations(); }
    std::span<const Implementation> operator()(const graph::Dilate&) const { return dilate_implementations(); }
    std::span<const Implementation> operator()(const graph::Fill&) const { return fill_implementations(); }
    std::span<const Implementation> operator()(const graph::DepthBefore&) const {
        return depth_before_implementations();
    }
    std::span<const Implementation> operator()(const graph::PreviousDepth&) const {
        return previous_depth_implementations();
    }
    std::span<const Implementation> operator()(const graph::CheckedMotion&) const {
        return checked_motion_implementations();
    }
    std::span<const Implementation> operator()(const graph::Validity&) const { return validity_implementations(); }
    std::span<const Implementation> operator()(const graph::Reproject&) const { return reproject_implementations(); }
    std::span<const Implementation> operator()(const graph::Range&) const { return range_implementations(); }
    std::span<const Implementation> operator()(const graph::Believed&) const { return believed_implementations(); }
    std::span<const Implementation> operator()(const graph::LandedSource&) const {
        return landed_source_implementations();
    }
    std::span<const Implementation> operator()(const graph::MiddleMotion&) const {
        return middle_motion_implementations();
    }
    std::span<const Implementation> operator()(const graph::Between&) const { return between_implementations(); }
    std::span<const Implementation> operator()(const graph::WarpSharply&) const {
        return warp_sharply_implementations();
    }
    std::span<const Implementation> operator()(const graph::Residual&) const { return residual_implementations(); }
    std::span<const Implementation> operator()(const graph::Trust&) const { return trust_implementations(); }
    std::span<const Implementation> operator()(const graph::Collect&) const { return collect_implementations(); }
    std::span<const Implementation> operator()(const graph::Warp&) const { return warp_implementations(); }
    std::span<const Implementation> operator()(const graph::Pick&) const { return pick_implementations(); }
    std::span<const Implementation> operator()(const graph::Place&) const { return place_implementations(); }
    std::span<const Implementation> operator()(const graph::AveragePool&) const {
        return average_pool_implementations();
    }
    std::span<const Implementation> operator()(const graph::Sharpen&) const { return sharpen_implementations(); }
    std::span<const Implementation> operator()(const graph::OffsetMask&) const { return offset_mask_implementations(); }
    std::span<const Implementation> operator()(const graph::Project&) const { return project_implementations(); }
    std::span<const Implementation> operator()(const graph::Mlaa&) const { return mlaa_implementations(); }
    std::span<const Implementation> operator()(const graph::Radiance&) const { return radiance_implementations(); }
    std::span<const Implementation> operator()(const graph::Display&) const { return radiance_implementations(); }
    std::span<const Implementation> operator()(const graph::NssFar&) const { return nss_far_implementations(); }
    std::span<const Implementation> operator()(const graph::NssScatter&) const { return nss_scatter_implementations(); }
    std::span<const Implementation> operator()(const graph::NssGuide&) const { return nss_guide_implementations(); }
    std::span<const Implementation> operator()(const graph::NssFlicker&) const { return nss_flicker_implementations(); }
    std::span<const Implementation> operator()(const graph::NssInput&) const { return nss_input_implementations(); }
    std::span<const Implementation> operator()(const graph::NssResolve&) const { return nss_resolve_implementations(); }
    std::span<const Implementation> operator()(const graph::MaxPool&) const { return max_pool_implementations(); }
    std::span<const Implementation> operator()(const graph::Numbers&) const { return numbers_implementations(); }
    std::span<const Implementation> operator()(const graph::Pointwise&) const { return pointwise_implementations(); }

    // Written by ingest, carried over from the frame before, or views of another value's memory.
    std::span<const Implementation> operator()(const graph::Input&) const { return {}; }
    std::span<const Implementation> operator()(const graph::Plane&) const { return {}; }
    std::span<const Implementation> operator()(const graph::Previous&) const { return {}; }
    std::span<const Implementation> operator()(const graph::Import&) const { return {}; }
    std::span<const Implementation> operator()(const graph::ZeroUpsample&) const { return {}; }
    std::span<const Implementation> operator()(const graph::Tiles&) const { return {}; }
    std::span<const Implementation> operator()(const graph::SpaceToDepth&) const { return {}; }
    std::span<const Implementation> operator()(const graph::DepthToSpace&) const { return {}; }
    std::span<const Implementation> operator()(const graph::Concat&) const { return {}; }
    std::span<const Implementation> operator()(const graph::Slice&) const { return {}; }
};

}  // namespace

std::span<const Implementation> implementations(const graph::Node& node) { return std::visit(ByOperator{}, node.op); }

}  // namespace clarus::runtime
