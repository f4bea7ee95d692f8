package mapserver

import (
	"fmt"
	"math"

	pb "hypermap-gateway/gen/hypermapv1"
)

// Run is the cells ColBegin <= column < ColEnd of a row, which share a value. NaN is unknown.
type Run struct {
	Row, ColBegin, ColEnd int32
	Value                 float64
}

// Cells is the content of a layer of cells.
type Cells struct {
	// Geometry of the grid, or nil if there are no cells.
	Geometry *pb.GridGeometry
	// The box around all cells.
	Box   pb.CellBox
	parts []*pb.CellRuns
}

// NewCells returns the cells of an answer about a layer. Fails if the box around them has more than `most` cells.
func NewCells(parts []*pb.LayerPart, most int64) (*Cells, error) {
	c := &Cells{}
	for _, part := range parts {
		if cells := part.GetCells(); len(cells.GetRows()) > 0 {
			c.Geometry = cells.GetGrid()
			c.parts = append(c.parts, cells)
		}
	}
	isFirst := true
	for run := range c.Upwards {
		if isFirst {
			c.Box = pb.CellBox{RowBegin: run.Row, ColBegin: run.ColBegin, ColEnd: run.ColEnd}
			isFirst = false
		}
		c.Box.RowEnd = run.Row + 1
		c.Box.ColBegin = min(c.Box.ColBegin, run.ColBegin)
		c.Box.ColEnd = max(c.Box.ColEnd, run.ColEnd)
	}
	// Compared by division, because the product may be too large for 64 bits.
	if rows, columns := c.Rows(), c.Columns(); columns > 0 && rows > most/columns {
		return nil, fmt.Errorf("the cells lie in a box of %d rows and %d columns, which may have %d cells", rows, columns, most)
	}
	return c, nil
}

// Rows returns the number of rows of the box.
func (c *Cells) Rows() int64 { return int64(c.Box.RowEnd) - int64(c.Box.RowBegin) }

// Columns returns the number of columns of the box.
func (c *Cells) Columns() int64 { return int64(c.Box.ColEnd) - int64(c.Box.ColBegin) }

// Upwards iterates over the runs, the lowest row first, and within a row by column.
func (c *Cells) Upwards(yield func(Run) bool) {
	for _, part := range c.parts {
		for i := range part.GetRows() {
			if !yield(runAt(part, i)) {
				return
			}
		}
	}
}

// Downwards iterates in the opposite order.
func (c *Cells) Downwards(yield func(Run) bool) {
	for p := len(c.parts) - 1; p >= 0; p-- {
		for i := len(c.parts[p].GetRows()) - 1; i >= 0; i-- {
			if !yield(runAt(c.parts[p], i)) {
				return
			}
		}
	}
}

func runAt(part *pb.CellRuns, i int) Run {
	return Run{part.GetRows()[i], part.GetColBegins()[i], part.GetColEnds()[i], part.GetValues()[i]}
}

// Corner returns the place of the lower left corner of the box, in the frame of the question.
func (c *Cells) Corner() (x, y float64) {
	origin := c.Geometry.GetOrigin()
	sin, cos := math.Sincos(origin.GetYaw())
	along := float64(c.Box.ColBegin) * c.Geometry.GetResolutionM()
	up := float64(c.Box.RowBegin) * c.Geometry.GetResolutionM()
	return origin.GetX() + cos*along - sin*up, origin.GetY() + sin*along + cos*up
}
