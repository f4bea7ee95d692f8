package foxglove

import (
	"math"
	"math/rand/v2"
	"testing"
	"time"
)

// areaOf returns the area of a ring.
func areaOf(ring []vector3) float64 {
	doubled := 0.0
	for i, p := range ring {
		next := ring[(i+1)%len(ring)]
		doubled += p.X*next.Y - p.Y*next.X
	}
	return doubled / 2
}

// expectFilled fails unless the triangles cover the area of the ring without overlapping.
func expectFilled(t *testing.T, name string, ring []vector3) {
	t.Helper()
	triangles := triangulate(ring)
	if triangles == nil {
		t.Errorf("%s: no triangles", name)
	}
	sum := 0.0
	for i := 0; i < len(triangles); i += 3 {
		area := cross(ring[triangles[i]], ring[triangles[i+1]], ring[triangles[i+2]]) / 2
		if area <= 0 {
			t.Errorf("%s: a triangle has the area %g", name, area)
		}
		sum += area
	}
	if whole := areaOf(ring); math.Abs(sum-whole) > 1e-9*whole {
		t.Errorf("%s: the triangles have the area %g, the polygon %g", name, sum, whole)
	}
}

func TestTrianglesFillAPolygon(t *testing.T) {
	expectFilled(t, "triangle", []vector3{{}, {X: 1}, {Y: 1}})
	expectFilled(t, "square with a vertex on an edge", []vector3{{}, {X: 1}, {X: 2}, {X: 2, Y: 2}, {Y: 2}})
	expectFilled(t, "L", []vector3{{}, {X: 2}, {X: 2, Y: 1}, {X: 1, Y: 1}, {X: 1, Y: 2}, {Y: 2}})
	expectFilled(t, "comb", []vector3{
		{}, {X: 5}, {X: 5, Y: 3}, {X: 4, Y: 3}, {X: 4, Y: 1}, {X: 3, Y: 1}, {X: 3, Y: 3}, {X: 2, Y: 3}, {X: 2, Y: 1}, {X: 1, Y: 1}, {X: 1, Y: 3}, {Y: 3},
	})
}

func TestTrianglesFillRandomStars(t *testing.T) {
	seed := uint64(time.Now().UnixNano())
	t.Logf("seed %d", seed)
	random := rand.New(rand.NewPCG(seed, 0))
	for range 200 {
		var ring []vector3
		corners := 3 + random.IntN(60)
		for i := range corners {
			radius := 1 + 9*random.Float64()
			sin, cos := math.Sincos(2 * math.Pi * float64(i) / float64(corners))
			ring = append(ring, vector3{X: radius * cos, Y: radius * sin})
		}
		expectFilled(t, "star", ring)
	}
}

func TestLargePolygonsAreNotFilled(t *testing.T) {
	if triangulate(make([]vector3, maxFilledVertices+1)) != nil {
		t.Error("a large polygon was filled")
	}
}
