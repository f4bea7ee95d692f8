package vda5050

import (
	"bytes"
	"fmt"
	"io"
	"math"
	"slices"
	"strconv"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// Pixels of map_saver, and the thresholds that tell them apart. The server's own export writes the same
// (storage/interchange/nav2.cc).
const (
	pixelFree     = 254
	pixelOccupied = 0
	pixelUnknown  = 205

	yamlOccupied = 0.65
	yamlFree     = 0.196
)

// image is an occupancy layer as an image for nav2.
type image struct {
	*mapserver.Cells
	thresholds *pb.OccupancyThresholds
}

// writeYAML writes the file that says where the image with a name lies. Names of layers need no quotes.
func (m image) writeYAML(w io.Writer, name string) error {
	x, y := m.Corner()
	_, err := fmt.Fprintf(w, "image: %s\nresolution: %s\norigin: [%s, %s, %s]\nnegate: 0\noccupied_thresh: %s\nfree_thresh: %s\nmode: trinary\n",
		name, number(m.Geometry.GetResolutionM()), number(x), number(y),
		number(m.Geometry.GetOrigin().GetYaw()), number(yamlOccupied), number(yamlFree))
	return err
}

func number(value float64) string { return strconv.FormatFloat(value, 'g', -1, 64) }

// writePGM writes the image. It holds one row in memory; the highest comes first.
func (m image) writePGM(w io.Writer) error {
	if _, err := fmt.Fprintf(w, "P5\n%d %d\n255\n", m.Columns(), m.Rows()); err != nil {
		return err
	}
	unknown := bytes.Repeat([]byte{pixelUnknown}, int(m.Columns()))
	row := slices.Clone(unknown)
	current := m.Box.RowEnd - 1
	for run := range m.Downwards {
		for ; current > run.Row; current-- {
			if _, err := w.Write(row); err != nil {
				return err
			}
			copy(row, unknown)
		}
		pixel := m.pixelOf(run.Value)
		for col := run.ColBegin; col < run.ColEnd; col++ {
			row[col-m.Box.ColBegin] = pixel
		}
	}
	_, err := w.Write(row)
	return err
}

// pixelOf returns the pixel of a probability, which is rounded to hundredths. Certainly free and occupied cells stay
// so, whatever the thresholds are.
func (m image) pixelOf(probability float64) byte {
	if math.IsNaN(probability) {
		return pixelUnknown
	}
	hundredths := math.Round(probability * 100)
	switch {
	case hundredths == 0:
		return pixelFree
	case hundredths == 100:
		return pixelOccupied
	case hundredths/100 < m.thresholds.GetFreeBelow():
		return pixelFree
	case hundredths/100 > m.thresholds.GetOccupiedAbove():
		return pixelOccupied
	}
	return pixelUnknown
}
