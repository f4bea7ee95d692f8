package foxglove

import (
	"encoding/base64"
	"encoding/binary"
	"io"
	"math"
	"slices"
	"time"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

const (
	// maxGridCells bounds the cells of a foxglove.Grid, which takes eleven bytes for each.
	maxGridCells = 16 << 20
	// cellBytes is the size of a cell: its value (FLOAT32) and its colour (four of UINT8).
	cellBytes = 8
)

// Numeric types of foxglove.PackedElementField.
const (
	typeUint8   = 1
	typeFloat32 = 7
)

type packedField struct {
	Name   string `json:"name"`
	Offset int    `json:"offset"`
	Type   int    `json:"type"`
}

// cellFields describe a cell.
var cellFields = []packedField{
	{"value", 0, typeFloat32},
	{"red", 4, typeUint8}, {"green", 5, typeUint8}, {"blue", 6, typeUint8}, {"alpha", 7, typeUint8},
}

// gridHead is a foxglove.Grid without its data.
type gridHead struct {
	Timestamp   timestamp     `json:"timestamp"`
	FrameID     string        `json:"frame_id"`
	Pose        pose          `json:"pose"`
	ColumnCount int           `json:"column_count"`
	CellSize    vector2       `json:"cell_size"`
	RowStride   int           `json:"row_stride"`
	CellStride  int           `json:"cell_stride"`
	Fields      []packedField `json:"fields"`
}

// grid is the content of a layer of cells.
type grid struct{ *mapserver.Cells }

// newGrid returns the grid of a layer's answer. It fails if the box around its cells is too large for a message.
func newGrid(parts []*pb.LayerPart) (grid, error) {
	cells, err := mapserver.NewCells(parts, maxGridCells)
	return grid{cells}, err
}

// size returns about how many bytes write writes.
func (g grid) size() int64 { return 2048 + g.Rows()*g.Columns()*cellBytes*4/3 }

// write writes the grid as a foxglove.Grid. It holds one row in memory. A grid without cells has one that is
// transparent, because programs divide by the number of columns.
func (g grid) write(w io.Writer, frame string, paint palette, now time.Time) error {
	columns := max(int(g.Columns()), 1)
	resolution := g.Geometry.GetResolutionM()
	if g.Geometry == nil {
		resolution = 1
	}
	x, y := g.Corner()
	head := mustMarshal(gridHead{
		Timestamp:   toTimestamp(now),
		FrameID:     frame,
		Pose:        pose{vector3{X: x, Y: y}, yawed(g.Geometry.GetOrigin().GetYaw())},
		ColumnCount: columns,
		CellSize:    vector2{resolution, resolution},
		RowStride:   columns * cellBytes,
		CellStride:  cellBytes,
		Fields:      cellFields,
	})
	if _, err := w.Write(append(head[:len(head)-1], `,"data":"`...)); err != nil {
		return err
	}
	encoder := base64.NewEncoder(base64.StdEncoding, w)
	if err := g.writeCells(encoder, columns, paint); err != nil {
		return err
	}
	if err := encoder.Close(); err != nil {
		return err
	}
	_, err := w.Write([]byte(`"}`))
	return err
}

func (g grid) writeCells(w io.Writer, columns int, paint palette) error {
	unknown := slices.Repeat(paint.cell(math.NaN()), columns)
	if g.Geometry == nil {
		_, err := w.Write(unknown)
		return err
	}
	row := slices.Clone(unknown)
	current := g.Box.RowBegin
	for r := range g.Upwards {
		for ; current < r.Row; current++ {
			if _, err := w.Write(row); err != nil {
				return err
			}
			copy(row, unknown)
		}
		cell := paint.cell(r.Value)
		for col := r.ColBegin; col < r.ColEnd; col++ {
			copy(row[int(col-g.Box.ColBegin)*cellBytes:], cell)
		}
	}
	_, err := w.Write(row)
	return err
}

// palette gives the values of a grid their colours.
type palette struct {
	ramp ramp
	// The values at the ends of the ramp.
	lowest, highest float64
}

// newPalette returns the palette of a layer, as the dashboard has it.
func newPalette(layer *pb.Layer, g grid) palette {
	properties := layer.GetProperties()
	p := palette{ramp: measurementsRamp}
	if slices.Contains(properties.GetWords(), "free") && slices.Contains(properties.GetWords(), "occupied") {
		p.ramp = floorRamp
	} else if properties.GetIsBinary() {
		p.ramp = binaryRamp
	}
	if values := properties.GetValueRange(); values.GetMin() < values.GetMax() {
		p.lowest, p.highest = values.GetMin(), values.GetMax()
		return p
	}
	if properties.GetIsBinary() {
		p.highest = 1
		return p
	}
	p.lowest, p.highest = math.Inf(1), math.Inf(-1)
	for r := range g.Upwards {
		if !math.IsNaN(r.Value) {
			p.lowest, p.highest = min(p.lowest, r.Value), max(p.highest, r.Value)
		}
	}
	return p
}

// cell returns the bytes of a cell. Unknown cells, whose value is NaN, are transparent.
func (p palette) cell(value float64) []byte {
	cell := binary.LittleEndian.AppendUint32(nil, math.Float32bits(float32(value)))
	if math.IsNaN(value) {
		return append(cell, 0, 0, 0, 0)
	}
	place := 0.0
	if p.highest > p.lowest {
		place = (value - p.lowest) / (p.highest - p.lowest)
	}
	painted := p.ramp.at(place)
	return append(cell, painted[:]...)
}
