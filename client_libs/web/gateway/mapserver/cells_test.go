package mapserver

import (
	"math"
	"slices"
	"testing"

	pb "hypermap-gateway/gen/hypermapv1"
)

// part returns a part of an answer with cells of the value 1, one in each of the places.
func part(places ...[2]int32) *pb.LayerPart {
	cells := &pb.CellRuns{Grid: &pb.GridGeometry{Origin: &pb.Pose{X: 1, Y: 2, Yaw: math.Pi / 2}, ResolutionM: 0.5}}
	for _, place := range places {
		cells.Rows = append(cells.Rows, place[0])
		cells.ColBegins = append(cells.ColBegins, place[1])
		cells.ColEnds = append(cells.ColEnds, place[1]+1)
		cells.Values = append(cells.Values, 1)
	}
	return &pb.LayerPart{Cells: cells}
}

func TestCellsLieInTheBoxAroundAllParts(t *testing.T) {
	cells, err := NewCells([]*pb.LayerPart{part([2]int32{-1, 4}, [2]int32{0, 2}), {}, part([2]int32{3, 3})}, 100)
	if err != nil {
		t.Fatal(err)
	}
	if cells.Rows() != 5 || cells.Columns() != 3 || cells.Box.ColBegin != 2 || cells.Box.RowBegin != -1 {
		t.Errorf("box %v", &cells.Box)
	}
	// A quarter turn: columns go up, rows to the left.
	if x, y := cells.Corner(); math.Abs(x-1.5) > 1e-9 || math.Abs(y-3) > 1e-9 {
		t.Errorf("corner (%g, %g)", x, y)
	}
	var up, down []int32
	for run := range cells.Upwards {
		up = append(up, run.Row)
	}
	for run := range cells.Downwards {
		down = append(down, run.Row)
	}
	if !slices.Equal(up, []int32{-1, 0, 3}) || !slices.Equal(down, []int32{3, 0, -1}) {
		t.Errorf("up %v, down %v", up, down)
	}
}

func TestCellsThatLieTooFarApartAreRefused(t *testing.T) {
	if _, err := NewCells([]*pb.LayerPart{part([2]int32{0, 0}, [2]int32{9, 9})}, 100); err != nil {
		t.Error(err)
	}
	if _, err := NewCells([]*pb.LayerPart{part([2]int32{0, 0}, [2]int32{9, 10})}, 100); err == nil {
		t.Error("a box of 110 cells was accepted")
	}
	// The number of cells of this box is not below 2^63.
	far := part([2]int32{math.MinInt32, math.MinInt32}, [2]int32{math.MaxInt32 - 1, math.MaxInt32 - 1})
	if _, err := NewCells([]*pb.LayerPart{far}, math.MaxInt64); err == nil {
		t.Error("a box of nearly 2^64 cells was accepted")
	}
}

func TestNoCells(t *testing.T) {
	cells, err := NewCells([]*pb.LayerPart{{}}, 1)
	if err != nil || cells.Geometry != nil || cells.Rows() != 0 || cells.Columns() != 0 {
		t.Errorf("%v, %v", cells, err)
	}
}
