#include "map/layers/grid/grid_geometry.h"
