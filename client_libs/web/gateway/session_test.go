package main

import (
	"net/http"
	"net/http/httptest"
	"strings"
	"testing"
	"time"
)

func mustSessions(t *testing.T, secure bool) *sessions {
	t.Helper()
	s, err := newSessions("", secure)
	if err != nil {
		t.Fatal(err)
	}
	return s
}

func requestWith(cookie *http.Cookie) *http.Request {
	r := httptest.NewRequest(http.MethodPost, "https://maps.example/", nil)
	r.AddCookie(cookie)
	return r
}

func TestCookieHasNoTokenAndIsHardened(t *testing.T) {
	s := mustSessions(t, true)
	cookie, err := s.seal("hm_0123_secret")
	if err != nil {
		t.Fatal(err)
	}
	text := cookie.String()
	for _, part := range []string{"__Host-hypermap=", "HttpOnly", "Secure", "SameSite=Strict", "Path=/"} {
		if !strings.Contains(text, part) {
			t.Errorf("%s is missing in %s", part, text)
		}
	}
	if strings.Contains(text, "secret") {
		t.Errorf("the token is in the cookie: %s", text)
	}
	if got := s.token(requestWith(cookie)); got != "hm_0123_secret" {
		t.Errorf("token %q", got)
	}
}

func TestOtherCookiesAreNoSession(t *testing.T) {
	s := mustSessions(t, true)
	cookie, err := s.seal("hm_0123_secret")
	if err != nil {
		t.Fatal(err)
	}
	for _, value := range []string{"", "x", cookie.Value[:20], "A" + cookie.Value[1:], cookie.Value + "AAAA"} {
		if value == cookie.Value {
			continue
		}
		if got := s.token(requestWith(s.cookie(value, time.Hour))); got != "" {
			t.Errorf("cookie %q has token %q", value, got)
		}
	}
	if got := mustSessions(t, true).token(requestWith(cookie)); got != "" {
		t.Error("another gateway opens the cookie")
	}
	s.now = func() time.Time { return time.Now().Add(sessionAge + time.Second) }
	if got := s.token(requestWith(cookie)); got != "" {
		t.Error("the session does not end")
	}
}

func TestOnlyOwnPagesActForTheSession(t *testing.T) {
	s := mustSessions(t, true)
	cookie, err := s.seal("hm_0123_secret")
	if err != nil {
		t.Fatal(err)
	}
	cases := []struct {
		header, value string
		signedIn      bool
	}{
		{"Origin", "https://maps.example", true},
		{"Origin", "https://evil.example", false},
		{"Origin", "null", false},
		{"Sec-Fetch-Site", "same-origin", true},
		{"Sec-Fetch-Site", "same-site", false},
		{"Sec-Fetch-Site", "cross-site", false},
		{"X-Nothing", "", true},
	}
	for _, c := range cases {
		r := requestWith(cookie)
		r.Header.Set(c.header, c.value)
		var got string
		s.signIn(http.HandlerFunc(func(_ http.ResponseWriter, r *http.Request) {
			got = r.Header.Get("Authorization")
			if r.Header.Get("Cookie") != "" {
				t.Error("the cookie is passed on")
			}
		})).ServeHTTP(httptest.NewRecorder(), r)
		if (got != "") != c.signedIn {
			t.Errorf("%s: %s: authorization %q", c.header, c.value, got)
		}
	}
}

func TestATokenOfTheCallWins(t *testing.T) {
	s := mustSessions(t, false)
	cookie, err := s.seal("hm_0123_secret")
	if err != nil {
		t.Fatal(err)
	}
	r := requestWith(cookie)
	r.Header.Set("Authorization", "Bearer other")
	s.signIn(http.HandlerFunc(func(_ http.ResponseWriter, r *http.Request) {
		if got := r.Header.Get("Authorization"); got != "Bearer other" {
			t.Errorf("authorization %q", got)
		}
	})).ServeHTTP(httptest.NewRecorder(), r)
}
