package main

import (
	"errors"
	"fmt"
	"io/fs"
	"net/http"
	"os"
	"path"
	"strings"
	"syscall"

	"connectrpc.com/connect"
	"github.com/klauspost/compress/gzhttp"
)

// contentSecurityPolicy forbids the page to load anything from other hosts. OpenLayers needs inline
// styles, and workers and images from blobs.
const contentSecurityPolicy = "default-src 'self'; style-src 'self' 'unsafe-inline'; " +
	"img-src 'self' blob: data:; worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'"

// newFiles serves the files in the folder, compressed. It serves nothing outside of the folder, even if
// a symbolic link points there.
func newFiles(folder string) (http.Handler, error) {
	root, err := os.OpenRoot(folder)
	if err != nil {
		return nil, fmt.Errorf("--dashboard: %w", err)
	}
	files := root.FS()
	server := http.FileServerFS(files)
	return gzhttp.GzipHandler(http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if status := statusOf(files, r.URL.Path); status != http.StatusOK {
			refuse(w, r, status, connect.CodeUnavailable, http.StatusText(status))
			return
		}
		header := w.Header()
		header.Set("Cache-Control", cacheControl(r.URL.Path))
		header.Set("Content-Security-Policy", contentSecurityPolicy)
		header.Set("Referrer-Policy", "same-origin")
		header.Set("X-Content-Type-Options", "nosniff")
		server.ServeHTTP(w, r)
	})), nil
}

// statusOf returns the status of the answer to a request for a file. Folders are not listed, and a path
// that can't be one of a file is not found, like one that is none.
func statusOf(files fs.FS, urlPath string) int {
	name := strings.TrimPrefix(path.Clean(urlPath), "/")
	if name == "" {
		name = "index.html"
	}
	info, err := fs.Stat(files, name)
	switch {
	case errors.Is(err, syscall.EMFILE), errors.Is(err, syscall.ENFILE), errors.Is(err, syscall.ENOMEM):
		return http.StatusServiceUnavailable
	case err != nil, !info.Mode().IsRegular():
		return http.StatusNotFound
	}
	return http.StatusOK
}

// cacheControl lets browsers keep built assets, whose names change with their content.
func cacheControl(urlPath string) string {
	if strings.HasPrefix(urlPath, "/assets/") {
		return "public, max-age=31536000, immutable"
	}
	return "no-cache"
}
