package main

import (
	"io"
	"net/http"
	"net/http/httptest"
	"os"
	"path/filepath"
	"strings"
	"testing"
)

func dashboard(t *testing.T) http.Handler {
	t.Helper()
	folder := t.TempDir()
	writeFile(t, folder, "secret.txt", "not for you")
	writeFile(t, folder, "dashboard/index.html", "<title>Hypermap</title>")
	writeFile(t, folder, "dashboard/assets/main-1a2b.js", strings.Repeat("let a = 1;\n", 1000))
	if err := os.Symlink("../secret.txt", filepath.Join(folder, "dashboard/link.txt")); err != nil {
		t.Fatal(err)
	}
	handler, err := newFiles(filepath.Join(folder, "dashboard"))
	if err != nil {
		t.Fatal(err)
	}
	return handler
}

func get(t *testing.T, handler http.Handler, path string, header http.Header) *http.Response {
	t.Helper()
	request := httptest.NewRequest(http.MethodGet, "/", nil)
	request.URL.Path = path
	request.Header = header
	recorder := httptest.NewRecorder()
	handler.ServeHTTP(recorder, request)
	return recorder.Result()
}

func TestServesThePageAndItsAssets(t *testing.T) {
	handler := dashboard(t)
	page := get(t, handler, "/", nil)
	text, _ := io.ReadAll(page.Body)
	if page.StatusCode != http.StatusOK || string(text) != "<title>Hypermap</title>" {
		t.Errorf("%s %q", page.Status, text)
	}
	if got := page.Header.Get("Cache-Control"); got != "no-cache" {
		t.Errorf("the page may be cached: %q", got)
	}
	if !strings.Contains(page.Header.Get("Content-Security-Policy"), "default-src 'self'") {
		t.Error("the page may load from other hosts")
	}
	asset := get(t, handler, "/assets/main-1a2b.js", nil)
	if got := asset.Header.Get("Cache-Control"); !strings.Contains(got, "immutable") {
		t.Errorf("an asset is not cached: %q", got)
	}
}

func TestCompressesForClientsThatAcceptGzip(t *testing.T) {
	asset := get(t, dashboard(t), "/assets/main-1a2b.js", http.Header{"Accept-Encoding": {"gzip"}})
	text, _ := io.ReadAll(asset.Body)
	if asset.Header.Get("Content-Encoding") != "gzip" || len(text) > 1000 {
		t.Errorf("%d bytes, encoding %q", len(text), asset.Header.Get("Content-Encoding"))
	}
}

func TestServesNothingOutsideOfTheFolder(t *testing.T) {
	handler := dashboard(t)
	for _, path := range []string{"/assets", "/assets/", "/nothing", "/../secret.txt", "/link.txt", "/assets/../../secret.txt"} {
		response := get(t, handler, path, nil)
		text, _ := io.ReadAll(response.Body)
		if response.StatusCode < 400 || strings.Contains(string(text), "not for you") {
			t.Errorf("%s: %s %q", path, response.Status, text)
		}
	}
}
