package foxglove

import (
	"context"

	pb "hypermap-gateway/gen/hypermapv1"
)

// relist asks for the layers, and tells the client which channels came and went.
func (s *session) relist(ctx context.Context) error {
	layers, err := s.layers(ctx)
	if err != nil {
		return &refused{"layers", err}
	}
	gone := map[string]*channel{}
	for _, old := range s.channels {
		gone[old.topic] = old
	}
	s.channels = nil
	var added []advertisedChannel
	keep := func(topic string, layer *pb.Layer) {
		kept, known := gone[topic]
		if !known {
			kept = &channel{id: s.nextChannel, topic: topic, paced: paced{isDue: true}}
			s.nextChannel++
		}
		kept.layer = layer
		if !known {
			added = append(added, kept.advertised())
		}
		delete(gone, topic)
		s.channels = append(s.channels, kept)
	}
	keep(transformsTopic, nil)
	for _, layer := range layers {
		keep(topicOf(layer), layer)
	}
	if err := s.remove(ctx, gone); err != nil {
		return err
	}
	if len(added) > 0 {
		if err := s.send(ctx, advertise{"advertise", added}); err != nil {
			return err
		}
	}
	return s.solved(ctx, "layers")
}

// remove tells the client which channels went, and ends their subscriptions.
func (s *session) remove(ctx context.Context, gone map[string]*channel) error {
	if len(gone) == 0 {
		return nil
	}
	var ids []uint32
	for _, channel := range gone {
		ids = append(ids, channel.id)
		if channel.subscription != nil {
			delete(s.subscriptions, *channel.subscription)
		}
		if err := s.solved(ctx, channel.topic); err != nil {
			return err
		}
	}
	return s.send(ctx, unadvertise{"unadvertise", ids})
}

// layers returns the layers of the revision that is shown, sorted by name.
func (s *session) layers(ctx context.Context) ([]*pb.Layer, error) {
	newest, err := s.caller.Layers(ctx, s.name)
	if err != nil || !s.asOf.isPast() {
		return newest, err
	}
	names, err := s.caller.Names(ctx, s.scope(), s.asOf.selected)
	if err != nil {
		return nil, err
	}
	listed := map[string]*pb.Layer{}
	for _, layer := range newest {
		listed[layer.GetName()] = layer
	}
	var layers []*pb.Layer
	for _, content := range names.GetLayers() {
		layer := listed[content.GetLayer()]
		if layer == nil || layer.GetKind() != content.GetKind() {
			layer = unlisted(content.GetLayer(), content.GetKind())
		}
		layers = append(layers, layer)
	}
	return layers, nil
}

// transforms returns the frame tree of the revision that is shown.
func (s *session) transforms(ctx context.Context) ([]*pb.Transform, error) {
	if s.asOf.isPast() {
		return s.caller.PastTransforms(ctx, s.scope(s.smallestLayer()...), s.asOf.revision)
	}
	newest, err := s.caller.Transforms(ctx, s.name)
	return newest.GetTransforms(), err
}

// smallestLayer returns the name of the layer with the least content, or none if there are no layers.
func (s *session) smallestLayer() []string {
	var smallest *pb.Layer
	for _, channel := range s.channels {
		// The size of a layer that was deleted since is not known.
		listed := channel.layer.GetVersion() > 0
		if listed && (smallest == nil || channel.layer.GetSize() < smallest.GetSize()) {
			smallest = channel.layer
		}
	}
	if smallest == nil {
		return nil
	}
	return []string{smallest.GetName()}
}
