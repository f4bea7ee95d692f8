// A box of pixels.
#ifndef HYPERMAP_SIMULATION_WORLDS_PIXEL_BOX_H_
#define HYPERMAP_SIMULATION_WORLDS_PIXEL_BOX_H_

namespace hypermap::simulation {

// Columns u and rows v of an image; ends exclusive.
struct PixelBox {
  int u_begin = 0;
  int u_end = 0;
  int v_begin = 0;
  int v_end = 0;
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_PIXEL_BOX_H_
