package foxglove

import (
	"math"
	"strings"
)

// The colours of the dashboard on a light page, see client_libs/web/dashboard/src/map/colours.ts.

// rgba is a colour, each part of it in 0..255.
type rgba [4]uint8

// colour is Foxglove's colour, each part of it in [0, 1].
type colour struct {
	R float64 `json:"r"`
	G float64 `json:"g"`
	B float64 `json:"b"`
	A float64 `json:"a"`
}

func (c rgba) colour() colour {
	part := func(value uint8) float64 { return math.Round(float64(value)/255*1e4) / 1e4 }
	return colour{part(c[0]), part(c[1]), part(c[2]), part(c[3])}
}

// oklch converts an opaque colour from OKLCH: https://bottosson.github.io/posts/oklab/
func oklch(lightness, chroma, hueDegrees float64) rgba {
	sin, cos := math.Sincos(hueDegrees * math.Pi / 180)
	a, b := chroma*cos, chroma*sin
	cube := func(x float64) float64 { return x * x * x }
	l := cube(lightness + 0.3963377774*a + 0.2158037573*b)
	m := cube(lightness - 0.1055613458*a - 0.0638541728*b)
	s := cube(lightness - 0.0894841775*a - 1.291485548*b)
	return rgba{
		srgb(4.0767416621*l - 3.3077115913*m + 0.2309699292*s),
		srgb(-1.2684380046*l + 2.6097574011*m - 0.3413193965*s),
		srgb(-0.0041960863*l - 0.7034186147*m + 1.707614701*s),
		255,
	}
}

func srgb(linear float64) uint8 {
	x := min(1, max(0, linear))
	if x <= 0.0031308 {
		return uint8(math.Round(255 * 12.92 * x))
	}
	return uint8(math.Round(255 * (1.055*math.Pow(x, 1/2.4) - 0.055)))
}

// classColour returns the colour of a class of objects, which depends on its name only.
func classColour(label string) rgba {
	const hues = 24
	h := uint32(0x811c9dc5) // FNV-1a
	for _, b := range []byte(strings.Trim(label, "\t\n\v\f\r ")) {
		if 'A' <= b && b <= 'Z' {
			b += 'a' - 'A'
		}
		h = (h ^ uint32(b)) * 0x01000193
	}
	return oklch(0.5+float64((h>>8)%3)*0.06, 0.15, float64(h%hues)*(360/hues))
}

// ramp has colours for equal steps from the lowest value of a grid to the highest.
type ramp []rgba

var (
	// floorRamp goes from certainly free to certainly occupied.
	floorRamp = ramp{{255, 255, 255, 255}, {240, 242, 245, 255}, {216, 221, 228, 255}, {172, 180, 190, 255}, {52, 60, 72, 255}}
	// binaryRamp goes from the lower of two values to the upper one.
	binaryRamp = ramp{oklch(0.62, 0.12, 300).faded(0.6), oklch(0.78, 0.1, 165).faded(0.35)}
	// measurementsRamp is viridis.
	measurementsRamp = ramp{{68, 1, 84, 255}, {59, 82, 139, 255}, {33, 145, 140, 255}, {94, 201, 98, 255}, {253, 231, 37, 255}}
)

func (c rgba) faded(alpha float64) rgba {
	c[3] = uint8(math.Round(alpha * 255))
	return c
}

// at returns the colour at a place in [0, 1] of the ramp.
func (r ramp) at(place float64) rgba {
	scaled := min(1, max(0, place)) * float64(len(r)-1)
	below := min(int(scaled), len(r)-2)
	t := scaled - float64(below)
	var mixed rgba
	for i := range mixed {
		from, to := float64(r[below][i]), float64(r[below+1][i])
		mixed[i] = uint8(math.Round(from + (to-from)*t))
	}
	return mixed
}
