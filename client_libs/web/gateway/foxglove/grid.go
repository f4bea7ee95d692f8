package foxglove

import (
	"encoding/base64"
	"encoding/binary"
	"fmt"
	"io"
	"math"
	"slices"
	"time"

	pb "hypermap-gateway/gen/hypermapv1"
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

// run is cells of a row that share a value.
type run struct {
	row, colBegin, colEnd int32
	value                 float64
}

// grid is the content of a layer of cells. Its runs are sorted by row and column.
type grid struct {
	geometry *pb.GridGeometry
	parts    []*pb.CellRuns
	// The box around all runs.
	box pb.CellBox
}

// newGrid returns the grid of a layer's answer. It fails if the box around its cells is too large for a message.
func newGrid(parts []*pb.LayerPart) (*grid, error) {
	g := &grid{}
	for _, part := range parts {
		if cells := part.GetCells(); len(cells.GetRows()) > 0 {
			g.geometry = cells.GetGrid()
			g.parts = append(g.parts, cells)
		}
	}
	begun := false
	for r := range g.runs {
		if !begun {
			g.box = pb.CellBox{RowBegin: r.row, ColBegin: r.colBegin, ColEnd: r.colEnd}
			begun = true
		}
		g.box.RowEnd = r.row + 1
		g.box.ColBegin = min(g.box.ColBegin, r.colBegin)
		g.box.ColEnd = max(g.box.ColEnd, r.colEnd)
	}
	if cells := g.rows() * g.columns(); cells > maxGridCells {
		return nil, fmt.Errorf("its cells lie in a box of %d cells, a message may have %d", cells, maxGridCells)
	}
	return g, nil
}

func (g *grid) rows() int64    { return int64(g.box.RowEnd) - int64(g.box.RowBegin) }
func (g *grid) columns() int64 { return int64(g.box.ColEnd) - int64(g.box.ColBegin) }

// runs iterates over the runs.
func (g *grid) runs(yield func(run) bool) {
	for _, part := range g.parts {
		for i, row := range part.GetRows() {
			if !yield(run{row, part.GetColBegins()[i], part.GetColEnds()[i], part.GetValues()[i]}) {
				return
			}
		}
	}
}

// size returns about how many bytes write writes.
func (g *grid) size() int64 { return 2048 + g.rows()*g.columns()*cellBytes*4/3 }

// write writes the grid as a foxglove.Grid. It holds one row in memory. A grid without cells has one that is
// transparent, because programs divide by the number of columns.
func (g *grid) write(w io.Writer, frame string, paint palette, now time.Time) error {
	columns := max(int(g.columns()), 1)
	resolution := g.geometry.GetResolutionM()
	if g.geometry == nil {
		resolution = 1
	}
	head := mustMarshal(gridHead{
		Timestamp:   toTimestamp(now),
		FrameID:     frame,
		Pose:        cornerOf(g.geometry, g.box.RowBegin, g.box.ColBegin),
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

func (g *grid) writeCells(w io.Writer, columns int, paint palette) error {
	unknown := slices.Repeat(paint.cell(math.NaN()), columns)
	if g.geometry == nil {
		_, err := w.Write(unknown)
		return err
	}
	row := slices.Clone(unknown)
	current := g.box.RowBegin
	for r := range g.runs {
		for ; current < r.row; current++ {
			if _, err := w.Write(row); err != nil {
				return err
			}
			copy(row, unknown)
		}
		cell := paint.cell(r.value)
		for col := r.colBegin; col < r.colEnd; col++ {
			copy(row[int(col-g.box.ColBegin)*cellBytes:], cell)
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
func newPalette(layer *pb.Layer, g *grid) palette {
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
	for r := range g.runs {
		if !math.IsNaN(r.value) {
			p.lowest, p.highest = min(p.lowest, r.value), max(p.highest, r.value)
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
