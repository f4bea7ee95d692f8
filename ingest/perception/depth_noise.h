// Noise model of structured-light depth cameras.
#ifndef HYPERMAP_INGEST_PERCEPTION_DEPTH_NOISE_H_
#define HYPERMAP_INGEST_PERCEPTION_DEPTH_NOISE_H_

namespace hypermap::ingest {

// Returns the standard deviation in metres of a Kinect's depth along the optical axis at depth
// `z_m`, for surfaces seen at less than 60 degrees (Nguyen, Izadi, Lovell 2012, eq. 3). `Depth` is
// float or one of the compiler's vectors of floats.
template <typename Depth>
inline Depth DepthSigma(Depth z_m) {
  const Depth d = z_m - 0.4f;
  return 0.0012f + 0.0019f * d * d;
}

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_DEPTH_NOISE_H_
