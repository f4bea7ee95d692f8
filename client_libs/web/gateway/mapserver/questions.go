package mapserver

import (
	"context"

	"connectrpc.com/connect"

	pb "hypermap-gateway/gen/hypermapv1"
)

// reach is the distance in metres from the origin of a frame within which all content of a map lies.
const reach = 1e7

// everywhere is the area of questions for all content.
var everywhere = &pb.Polygon{Outer: &pb.Ring{
	Xs: []float64{-reach, reach, reach, -reach},
	Ys: []float64{-reach, -reach, reach, reach},
}}

// At returns the selection of a revision.
func At(revision int64) *pb.AsOf {
	return &pb.AsOf{AsOf: &pb.AsOf_AtRevision{AtRevision: revision}}
}

// GetMap returns a map without its content.
func (c *Caller) GetMap(ctx context.Context, name string) (*pb.Map, error) {
	answer, err := ask(ctx, c, c.Server.getMap, &pb.GetMapRequest{Map: name})
	return answer.GetMap(), err
}

// Layers returns the layers of the newest revision of a map, without their content, sorted by name.
func (c *Caller) Layers(ctx context.Context, name string) ([]*pb.Layer, error) {
	answer, err := ask(ctx, c, c.Server.listLayers, &pb.ListLayersRequest{Map: name})
	return answer.GetLayers(), err
}

// Names returns the names and kinds of the layers of a revision, sorted by name, and the revision that was
// selected.
func (c *Caller) Names(ctx context.Context, scope *pb.Scope, asOf *pb.AsOf) (*pb.QueryPointResponse, error) {
	return ask(ctx, c, c.Server.queryPoint, &pb.QueryPointRequest{Scope: scope, AsOf: asOf, Point: &pb.Point{}})
}

// Transforms returns the frame tree of the newest revision of a map.
func (c *Caller) Transforms(ctx context.Context, name string) (*pb.ListTransformsResponse, error) {
	return ask(ctx, c, c.Server.listTransforms, &pb.ListTransformsRequest{Map: name})
}

// Content is the content of layers at a revision.
type Content struct {
	Parts    []*pb.LayerPart
	Revision int64
	call     Call
}

// Close gives back the memory of the content, which is not to be used any more.
func (c *Content) Close() { c.call.End() }

// Content returns all content of the layers of the scope. The caller closes it.
func (c *Caller) Content(ctx context.Context, scope *pb.Scope, asOf *pb.AsOf) (*Content, error) {
	content := &Content{call: c.Admission.Begin(ctx)}
	err := stream(c, content.call, c.Server.queryArea,
		&pb.QueryAreaRequest{Scope: scope, AsOf: asOf, Area: everywhere},
		func(answer *pb.QueryAreaResponse) error {
			content.Revision = answer.GetRevision()
			if answer.GetPart() != nil {
				content.Parts = append(content.Parts, answer.GetPart())
			}
			return nil
		})
	if err != nil {
		content.Close()
		return nil, err
	}
	return content, nil
}

// PastTransforms returns the frame tree of a revision, which it finds in the changes since revision 0.
// OUT_OF_RANGE if they are no longer kept. The layer is one of the revision; it bounds what the server reads.
func (c *Caller) PastTransforms(ctx context.Context, scope *pb.Scope, revision int64) ([]*pb.Transform, error) {
	call := c.Admission.Begin(ctx)
	defer call.End()
	var found []*pb.Transform
	err := stream(c, call, c.Server.listChanges, &pb.ListChangesRequest{Scope: scope, ToRevision: &revision},
		func(answer *pb.ListChangesResponse) error {
			for _, change := range answer.GetChanges() {
				if change.GetTransform() != nil {
					found = append(found, change.GetTransform())
				}
			}
			call.Release()
			return nil
		})
	return found, err
}

// Watch calls `take` for each message about changes of a map after a revision, until ctx is done.
func (c *Caller) Watch(ctx context.Context, scope *pb.Scope, after int64, take func(*pb.WatchResponse)) error {
	call := c.Admission.Begin(ctx)
	defer call.End()
	request := &pb.WatchRequest{Scope: scope, StartRevision: &after, Coalesce: true}
	return stream(c, call, c.Server.watch, request, func(answer *pb.WatchResponse) error {
		take(answer)
		call.Release()
		return nil
	})
}

// IsCode reports whether the error of a call has one of the codes.
func IsCode(err error, codes ...connect.Code) bool {
	for _, code := range codes {
		if err != nil && connect.CodeOf(err) == code {
			return true
		}
	}
	return false
}
