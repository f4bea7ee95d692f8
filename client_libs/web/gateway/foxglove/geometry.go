package foxglove

import (
	"math"

	pb "hypermap-gateway/gen/hypermapv1"
)

type vector2 struct {
	X float64 `json:"x"`
	Y float64 `json:"y"`
}

type vector3 struct {
	X float64 `json:"x"`
	Y float64 `json:"y"`
	Z float64 `json:"z"`
}

type quaternion struct {
	X float64 `json:"x"`
	Y float64 `json:"y"`
	Z float64 `json:"z"`
	W float64 `json:"w"`
}

type pose struct {
	Position    vector3    `json:"position"`
	Orientation quaternion `json:"orientation"`
}

// yawed returns a rotation about the vertical axis.
func yawed(yaw float64) quaternion { return quaternion{Z: math.Sin(yaw / 2), W: math.Cos(yaw / 2)} }

// identity is the pose of a primitive whose points are in the frame of its entity.
var identity = pose{Orientation: quaternion{W: 1}}

// at returns the pose of a primitive that lies at a point.
func at(p *pb.Point) pose {
	return pose{Position: vector3{X: p.GetX(), Y: p.GetY()}, Orientation: quaternion{W: 1}}
}

// pointsOf returns the vertices that a message has in columns.
func pointsOf(xs, ys []float64) []vector3 {
	points := make([]vector3, 0, len(xs))
	for i := range min(len(xs), len(ys)) {
		points = append(points, vector3{X: xs[i], Y: ys[i]})
	}
	return points
}
