package foxglove

import (
	"io"
	"time"

	pb "hypermap-gateway/gen/hypermapv1"
)

type frameTransforms struct {
	Transforms []frameTransform `json:"transforms"`
}

type frameTransform struct {
	Timestamp     timestamp  `json:"timestamp"`
	ParentFrameID string     `json:"parent_frame_id"`
	ChildFrameID  string     `json:"child_frame_id"`
	Translation   vector3    `json:"translation"`
	Rotation      quaternion `json:"rotation"`
}

// writeTransforms writes a frame tree as a foxglove.FrameTransforms.
func writeTransforms(w io.Writer, transforms []*pb.Transform, now time.Time) error {
	message := frameTransforms{Transforms: []frameTransform{}}
	for _, edge := range transforms {
		parent := edge.GetParentFromChild()
		message.Transforms = append(message.Transforms, frameTransform{
			Timestamp:     toTimestamp(now),
			ParentFrameID: edge.GetParentFrameId(),
			ChildFrameID:  edge.GetChildFrameId(),
			Translation:   vector3{X: parent.GetX(), Y: parent.GetY()},
			Rotation:      yawed(parent.GetYaw()),
		})
	}
	_, err := w.Write(mustMarshal(message))
	return err
}
