package vda5050

import (
	"archive/zip"
	"bytes"
	"context"
	"encoding/json"
	"fmt"
	"io"
	"strconv"

	"connectrpc.com/connect"
	"github.com/klauspost/compress/flate"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// maxImageCells bounds the pixels of an image.
const maxImageCells = 256 << 20

// manifest is the file map.json of a release.
type manifest struct {
	MapID      string `json:"mapId"`
	MapVersion string `json:"mapVersion"`
	// The frame of the images.
	Frame string `json:"frame"`
	// Names of the YAML files.
	Maps []string `json:"maps"`
}

// release is the file of a revision: a zip with a YAML and a PGM for each occupancy layer that has cells, as nav2
// loads them, and map.json. The bytes depend on the content alone: there are no times in it, the order is that of
// the layers' names, and the version of the compressor is pinned.
type release struct {
	buffer bytes.Buffer
	call   mapserver.Call
}

// newRelease makes the file of a revision. The caller closes it. NOT_FOUND if the revision has no occupancy layer
// with cells; OUT_OF_RANGE if it is no longer kept, or has an occupancy layer that was deleted since.
func newRelease(ctx context.Context, caller *mapserver.Caller, found *pb.Map, revision int64) (*release, error) {
	made := &release{call: caller.Admission.Begin(ctx)}
	if err := made.fill(ctx, caller, found, revision); err != nil {
		made.close()
		return nil, err
	}
	return made, nil
}

// close gives back the memory of the file, which is not to be used any more.
func (r *release) close() { r.call.End() }

func (r *release) zip() []byte { return r.buffer.Bytes() }

// Write takes the client's memory for what it keeps.
func (r *release) Write(data []byte) (int, error) {
	const copies = 2 // A buffer that grows by doubling.
	if err := r.call.Take(copies * int64(len(data))); err != nil {
		return 0, err
	}
	return r.buffer.Write(data)
}

func (r *release) fill(ctx context.Context, caller *mapserver.Caller, found *pb.Map, revision int64) error {
	layers, err := occupancyLayers(ctx, caller, found, revision)
	if err != nil {
		return err
	}
	archive := zip.NewWriter(r)
	archive.RegisterCompressor(zip.Deflate, func(w io.Writer) (io.WriteCloser, error) {
		return flate.NewWriter(w, flate.DefaultCompression)
	})
	about := manifest{
		MapID:      found.GetName(),
		MapVersion: strconv.FormatInt(revision, 10),
		Frame:      found.GetFrameId(),
		Maps:       []string{},
	}
	for _, layer := range layers {
		written, err := addLayer(ctx, archive, caller, found, layer, revision)
		if err != nil {
			return err
		}
		if written {
			about.Maps = append(about.Maps, layer.GetName()+".yaml")
		}
	}
	if len(about.Maps) == 0 {
		return connect.NewError(connect.CodeNotFound,
			fmt.Errorf("revision %d of map %s has no occupancy layer with cells", revision, found.GetName()))
	}
	text, err := json.MarshalIndent(about, "", "  ")
	if err != nil {
		return err
	}
	if err := addFile(archive, "map.json", func(w io.Writer) error {
		_, err := w.Write(append(text, '\n'))
		return err
	}); err != nil {
		return err
	}
	return archive.Close()
}

// occupancyLayers returns the occupancy layers of a revision, sorted by name.
func occupancyLayers(ctx context.Context, caller *mapserver.Caller, found *pb.Map, revision int64) ([]*pb.Layer, error) {
	scope := &pb.Scope{Map: found.GetName(), Incarnation: found.GetIncarnation()}
	names, err := caller.Names(ctx, scope, mapserver.At(revision))
	if err != nil {
		return nil, err
	}
	listed, err := caller.Layers(ctx, found.GetName())
	if err != nil {
		return nil, err
	}
	byName := map[string]*pb.Layer{}
	for _, layer := range listed {
		byName[layer.GetName()] = layer
	}
	var layers []*pb.Layer
	for _, content := range names.GetLayers() {
		if content.GetKind() != pb.LayerKind_LAYER_KIND_OCCUPANCY {
			continue
		}
		layer := byName[content.GetLayer()]
		if layer.GetKind() != content.GetKind() {
			// What counts as free and as occupied went with it.
			return nil, connect.NewError(connect.CodeOutOfRange, fmt.Errorf(
				"layer %s of revision %d was deleted since, so that its file can't be made any more", content.GetLayer(), revision))
		}
		layers = append(layers, layer)
	}
	return layers, nil
}

// addLayer adds the YAML and the image of a layer. Returns false, and adds nothing, if it has no cells.
func addLayer(ctx context.Context, archive *zip.Writer, caller *mapserver.Caller, found *pb.Map, layer *pb.Layer, revision int64) (bool, error) {
	scope := &pb.Scope{Map: found.GetName(), Layers: []string{layer.GetName()}, Incarnation: found.GetIncarnation()}
	content, err := caller.Content(ctx, scope, mapserver.At(revision))
	if err != nil {
		return false, err
	}
	defer content.Close()
	for _, part := range content.Parts {
		if status := part.GetStatus(); status != pb.AnswerStatus_ANSWER_STATUS_VALUE {
			return false, connect.NewError(connect.CodeFailedPrecondition,
				fmt.Errorf("layer %s has no place in the frame %s of the map: %v", layer.GetName(), found.GetFrameId(), status))
		}
	}
	cells, err := mapserver.NewCells(content.Parts, maxImageCells)
	if err != nil {
		return false, connect.NewError(connect.CodeFailedPrecondition, fmt.Errorf("layer %s: %w", layer.GetName(), err))
	}
	if cells.Geometry == nil {
		return false, nil
	}
	made := image{cells, layer.GetThresholds()}
	if err := addFile(archive, layer.GetName()+".yaml", func(w io.Writer) error {
		return made.writeYAML(w, layer.GetName()+".pgm")
	}); err != nil {
		return false, err
	}
	return true, addFile(archive, layer.GetName()+".pgm", made.writePGM)
}

// addFile adds a file. Its time is always the first one that the format has.
func addFile(archive *zip.Writer, name string, write func(io.Writer) error) error {
	const firstOfJanuary1980 = 1<<5 | 1
	file, err := archive.CreateHeader(&zip.FileHeader{Name: name, Method: zip.Deflate, ModifiedDate: firstOfJanuary1980})
	if err != nil {
		return err
	}
	return write(file)
}
