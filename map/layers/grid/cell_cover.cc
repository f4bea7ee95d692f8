#include "map/layers/grid/cell_cover.h"
