// Package vda5050 offers maps for download as VDA 5050 (3.0) has them: a map server is a place from which robots
// load a map by the mapDownloadLink of a fleet manager's downloadMap action.
//
// A map's mapId is its name, and a mapVersion is a revision. The files of a revision never change: they are made
// from what the server answers about that revision, and the same content gives the same bytes.
package vda5050

import (
	"bytes"
	"crypto/sha256"
	"encoding/base64"
	"encoding/hex"
	"encoding/json"
	"fmt"
	"net/http"
	"net/url"
	"strconv"
	"strings"
	"time"

	"connectrpc.com/connect"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// newest tells which file a fleet manager sends robots to.
type newest struct {
	MapID           string `json:"mapId"`
	MapVersion      string `json:"mapVersion"`
	MapDownloadLink string `json:"mapDownloadLink"`
	// SHA-256 of the file in hexadecimal digits, for the action's mapHash.
	SHA256 string `json:"sha256"`
}

// ServeNewest answers GET /vda5050/{map}: the newest revision, as a newest.
func ServeNewest(w http.ResponseWriter, r *http.Request, caller *mapserver.Caller) {
	found, err := caller.GetMap(r.Context(), r.PathValue("map"))
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	release, err := newRelease(r.Context(), caller, found, found.GetRevision())
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	defer release.close()
	version := strconv.FormatInt(found.GetRevision(), 10)
	link := url.URL{
		Scheme:   schemeOf(r),
		Host:     r.Host,
		Path:     "/vda5050/" + found.GetName() + "/" + version + ".zip",
		RawQuery: incarnationParameter + "=" + strconv.FormatUint(found.GetIncarnation(), 10),
	}
	digest := sha256.Sum256(release.zip())
	serveJSON(w, r, "no-cache", newest{found.GetName(), version, link.String(), hex.EncodeToString(digest[:])})
}

// ServeRelease answers GET /vda5050/{map}/{file}, where the file is REVISION.zip, or REVISION.zip.sha256 with the
// line that sha256sum checks.
func ServeRelease(w http.ResponseWriter, r *http.Request, caller *mapserver.Caller) {
	version, rest, isZip := strings.Cut(r.PathValue("file"), ".zip")
	if !isZip || (rest != "" && rest != ".sha256") {
		http.Error(w, "a file of a map is REVISION.zip or REVISION.zip.sha256", http.StatusNotFound)
		return
	}
	found, revision, err := findRevision(r, caller, version)
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	release, err := newRelease(r.Context(), caller, found, revision)
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	defer release.close()
	content := release.zip()
	digest := sha256.Sum256(content)
	header := w.Header()
	header.Set("Cache-Control", cacheControl(r))
	header.Set("X-Content-Type-Options", "nosniff")
	if rest == ".sha256" {
		content = fmt.Appendf(nil, "%x  %s.zip\n", digest, version)
		header.Set("Content-Type", "text/plain; charset=utf-8")
	} else {
		header.Set("Content-Type", "application/zip")
		header.Set("ETag", fmt.Sprintf(`"%x"`, digest))
		header.Set("Repr-Digest", "sha-256=:"+base64.StdEncoding.EncodeToString(digest[:])+":") // RFC 9530.
	}
	http.ServeContent(w, r, "", time.Time{}, bytes.NewReader(content))
}

// ServeZoneSet answers GET /vda5050/{map}/{revision}/zoneset.json?layer=LAYER: the zones of a semantic layer.
func ServeZoneSet(w http.ResponseWriter, r *http.Request, caller *mapserver.Caller) {
	layer := r.URL.Query().Get("layer")
	if layer == "" {
		http.Error(w, "the parameter layer is missing", http.StatusBadRequest)
		return
	}
	found, revision, err := findRevision(r, caller, r.PathValue("revision"))
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	scope := &pb.Scope{Map: found.GetName(), Layers: []string{layer}, Incarnation: found.GetIncarnation()}
	content, err := caller.Content(r.Context(), scope, mapserver.At(revision))
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	defer content.Close()
	zones, err := zonesOf(content.Parts)
	if err != nil {
		http.Error(w, err.Error(), http.StatusUnprocessableEntity)
		return
	}
	serveJSON(w, r, cacheControl(r), zoneSetMessage{zoneSet{
		MapID:     found.GetName(),
		ZoneSetID: fmt.Sprintf("%s/%s/%d", found.GetName(), layer, revision),
		Zones:     zones,
	}})
}

// incarnationParameter names the incarnation of the map in a link, see Map.incarnation of the protocol. Without it, a
// link leads to another file after the map was deleted and made anew.
const incarnationParameter = "incarnation"

// findRevision returns the map and the revision that a request names. Errors: NOT_FOUND, and ABORTED if the map is
// another incarnation.
func findRevision(r *http.Request, caller *mapserver.Caller, version string) (*pb.Map, int64, error) {
	revision, err := strconv.ParseInt(version, 10, 64)
	if err != nil || revision < 0 || strconv.FormatInt(revision, 10) != version {
		return nil, 0, connect.NewError(connect.CodeNotFound, fmt.Errorf("%q is not a revision", version))
	}
	found, err := caller.GetMap(r.Context(), r.PathValue("map"))
	if err != nil {
		return nil, 0, err
	}
	if asked := r.URL.Query().Get(incarnationParameter); asked != "" &&
		asked != strconv.FormatUint(found.GetIncarnation(), 10) {
		return nil, 0, connect.NewError(connect.CodeAborted,
			fmt.Errorf("map %s was deleted or replaced since, and its revisions are others now", found.GetName()))
	}
	if revision > found.GetRevision() {
		return nil, 0, connect.NewError(connect.CodeNotFound,
			fmt.Errorf("revision %d is still to come, the newest is %d", revision, found.GetRevision()))
	}
	return found, revision, nil
}

// cacheControl lets caches keep what a link with an incarnation leads to. Only the client keeps what needed a token.
func cacheControl(r *http.Request) string {
	who := "public"
	if r.Header.Get("Authorization") != "" {
		who = "private"
	}
	if !r.URL.Query().Has(incarnationParameter) {
		return who + ", no-cache"
	}
	return who + ", max-age=31536000, immutable"
}

// schemeOf returns the scheme by which the client reached the gateway, or a proxy that says so.
func schemeOf(r *http.Request) string {
	if r.TLS != nil || r.Header.Get("X-Forwarded-Proto") == "https" {
		return "https"
	}
	return "http"
}

func serveJSON(w http.ResponseWriter, r *http.Request, cacheControl string, value any) {
	text, err := json.Marshal(value)
	if err != nil {
		http.Error(w, err.Error(), http.StatusInternalServerError)
		return
	}
	header := w.Header()
	header.Set("Cache-Control", cacheControl)
	header.Set("Content-Type", "application/json")
	header.Set("X-Content-Type-Options", "nosniff")
	http.ServeContent(w, r, "", time.Time{}, bytes.NewReader(append(text, '\n')))
}
