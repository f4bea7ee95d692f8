package foxglove

import "slices"

// maxFilledVertices bounds the polygons that are filled, because the time of triangulate grows with the square of
// their vertices.
const maxFilledVertices = 500

// triangulate cuts a simple polygon, whose vertices run counter-clockwise, into triangles by clipping ears: each three
// indices are the vertices of one. Returns nil if the polygon is too large, or if rounding hides its ears.
func triangulate(ring []vector3) []uint32 {
	if len(ring) > maxFilledVertices {
		return nil
	}
	rest := make([]uint32, len(ring))
	for i := range rest {
		rest[i] = uint32(i)
	}
	triangles := []uint32{}
	for len(rest) >= 3 {
		clipped := false
		for i := range rest {
			before, here, after := rest[(i+len(rest)-1)%len(rest)], rest[i], rest[(i+1)%len(rest)]
			turn := cross(ring[before], ring[here], ring[after])
			if turn < 0 || turn > 0 && !isEar(ring, rest, before, here, after) {
				continue
			}
			// A vertex on a straight edge is left out.
			if turn > 0 {
				triangles = append(triangles, before, here, after)
			}
			rest = slices.Delete(rest, i, i+1)
			clipped = true
			break
		}
		if !clipped {
			return nil
		}
	}
	return triangles
}

// isEar reports whether no other vertex of the rest lies in the triangle, which turns to the left.
func isEar(ring []vector3, rest []uint32, a, b, c uint32) bool {
	for _, other := range rest {
		if other == a || other == b || other == c {
			continue
		}
		p := ring[other]
		if cross(ring[a], ring[b], p) >= 0 && cross(ring[b], ring[c], p) >= 0 && cross(ring[c], ring[a], p) >= 0 {
			return false
		}
	}
	return true
}

// cross returns twice the area of a triangle, which is positive if it turns to the left.
func cross(a, b, c vector3) float64 { return (b.X-a.X)*(c.Y-a.Y) - (b.Y-a.Y)*(c.X-a.X) }
