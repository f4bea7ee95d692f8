package main

import (
	"bytes"
	"fmt"
	"io/fs"
	"mime"
	"net/http"
	"os"
	"path"
	"strconv"
	"strings"
	"time"

	"connectrpc.com/connect"
	"github.com/klauspost/compress/gzip"
)

// contentSecurityPolicy forbids the page to load anything from other hosts. OpenLayers needs inline
// styles, and workers and images from blobs.
const contentSecurityPolicy = "default-src 'self'; style-src 'self' 'unsafe-inline'; " +
	"img-src 'self' blob: data:; worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'"

// maxFileBytes bounds the files of the dashboard together, which are held in memory.
const maxFileBytes = 256 << 20

// file is a file of the dashboard. All answers share its content, so that a client which reads slowly takes
// neither memory nor an open file.
type file struct {
	content  []byte
	kind     string
	modified time.Time
	// The content compressed, or nil if that does not pay.
	packed []byte
}

// files serves files from memory. It does not see what is changed in their folder later.
type files map[string]*file

// newFiles reads the files in the folder and compresses them. It reads nothing outside of the folder, even
// if a symbolic link points there.
func newFiles(folder string) (http.Handler, error) {
	root, err := os.OpenRoot(folder)
	if err != nil {
		return nil, fmt.Errorf("--dashboard: %w", err)
	}
	defer root.Close()
	f := files{}
	total := int64(0)
	err = fs.WalkDir(root.FS(), ".", func(name string, _ fs.DirEntry, err error) error {
		if err != nil {
			return err
		}
		info, err := fs.Stat(root.FS(), name)
		if err != nil || !info.Mode().IsRegular() {
			return nil // A folder, or a link that leads out of the folder or nowhere.
		}
		if total += info.Size(); total > maxFileBytes {
			return fmt.Errorf("the files in %s have more than %d bytes", folder, maxFileBytes)
		}
		content, err := fs.ReadFile(root.FS(), name)
		if err != nil {
			return err
		}
		f[name] = newFile(name, content, info.ModTime())
		return nil
	})
	if err != nil {
		return nil, fmt.Errorf("--dashboard: %w", err)
	}
	return f, nil
}

func newFile(name string, content []byte, modified time.Time) *file {
	made := &file{content: content, kind: mime.TypeByExtension(path.Ext(name)), modified: modified}
	if made.kind == "" {
		made.kind = http.DetectContentType(content)
	}
	var packed bytes.Buffer
	packer, _ := gzip.NewWriterLevel(&packed, gzip.DefaultCompression) // The level is valid.
	_, _ = packer.Write(content)                                       // A buffer takes all.
	_ = packer.Close()
	if len(content) >= compressMinBytes && packed.Len() < len(content)/10*9 {
		made.packed = bytes.Clone(packed.Bytes())
	}
	return made
}

// ServeHTTP answers a request for a file. Folders are not listed.
func (f files) ServeHTTP(w http.ResponseWriter, r *http.Request) {
	name := strings.TrimPrefix(path.Clean(r.URL.Path), "/")
	if name == "" {
		name = "index.html"
	}
	found := f[name]
	if found == nil {
		refuse(w, r, http.StatusNotFound, connect.CodeUnavailable, http.StatusText(http.StatusNotFound))
		return
	}
	header := w.Header()
	header.Set("Cache-Control", cacheControl(r.URL.Path))
	header.Set("Content-Security-Policy", contentSecurityPolicy)
	header.Set("Content-Type", found.kind)
	header.Set("Referrer-Policy", "same-origin")
	header.Set("X-Content-Type-Options", "nosniff")
	content := found.content
	if found.packed != nil {
		header.Add("Vary", "Accept-Encoding")
		if acceptsGzip(r.Header) {
			content = found.packed
			header.Set("Content-Encoding", "gzip")
			header.Set("Content-Length", strconv.Itoa(len(content)))
			r.Header.Del("Range") // A part of what is compressed would be of no use.
		}
	}
	http.ServeContent(w, r, name, found.modified, bytes.NewReader(content))
}

// acceptsGzip reports whether the client takes gzip, unless its weight is 0.
func acceptsGzip(header http.Header) bool {
	for _, entry := range strings.Split(strings.Join(header["Accept-Encoding"], ","), ",") {
		name, weight, _ := strings.Cut(entry, ";")
		if name = strings.TrimSpace(name); !strings.EqualFold(name, "gzip") && name != "*" {
			continue
		}
		weight = strings.ReplaceAll(weight, " ", "")
		return weight == "" || strings.Trim(strings.TrimPrefix(weight, "q="), "0.") != ""
	}
	return false
}

// cacheControl lets browsers keep built assets, whose names change with their content.
func cacheControl(urlPath string) string {
	if strings.HasPrefix(urlPath, "/assets/") {
		return "public, max-age=31536000, immutable"
	}
	return "no-cache"
}
