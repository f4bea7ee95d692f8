package main

import (
	"crypto/aes"
	"crypto/cipher"
	"crypto/rand"
	"encoding/base64"
	"encoding/json"
	"errors"
	"fmt"
	"io"
	"net/http"
	"os"
	"strings"
	"time"

	"connectrpc.com/connect"
)

// Browsers sign in with a token, which they get back sealed in a cookie: scripts can't read it, other sites
// can't send it, and the gateway keeps nothing. Whoever steals the cookie has the gateway's word for the
// token until the session ends, but not the token.

const (
	sessionPath   = "/session"
	sessionAge    = 12 * time.Hour
	maxTokenBytes = 4 << 10
	keyBytes      = 32
)

// sessions seals and opens the cookies of signed-in browsers. Safe for concurrent use.
type sessions struct {
	aead cipher.AEAD
	// Whether browsers come by TLS. Without it, they are on this machine (loopback is a secure context).
	secure bool
	now    func() time.Time
}

type session struct {
	Token   string    `json:"token"`
	Expires time.Time `json:"expires"`
}

// newSessions takes the key from a file of 32 random bytes, so that several gateways can share sessions and a
// restart keeps them; without a file it makes one for itself.
func newSessions(keyFile string, secure bool) (*sessions, error) {
	key := make([]byte, keyBytes)
	if keyFile == "" {
		if _, err := rand.Read(key); err != nil {
			return nil, err
		}
	} else {
		var err error
		if key, err = os.ReadFile(keyFile); err != nil {
			return nil, fmt.Errorf("--session_key: %w", err)
		}
		if len(key) != keyBytes {
			return nil, fmt.Errorf("--session_key: %s has %d bytes instead of %d", keyFile, len(key), keyBytes)
		}
	}
	block, err := aes.NewCipher(key)
	if err != nil {
		return nil, err
	}
	aead, err := cipher.NewGCM(block)
	if err != nil {
		return nil, err
	}
	return &sessions{aead: aead, secure: secure, now: time.Now}, nil
}

// name of the cookie. Browsers accept the prefix only over TLS, for this host and all paths.
func (s *sessions) name() string {
	if s.secure {
		return "__Host-hypermap"
	}
	return "hypermap"
}

func (s *sessions) cookie(value string, age time.Duration) *http.Cookie {
	return &http.Cookie{
		Name:     s.name(),
		Value:    value,
		Path:     "/",
		MaxAge:   int(age.Seconds()),
		HttpOnly: true,
		Secure:   s.secure,
		SameSite: http.SameSiteStrictMode,
	}
}

func (s *sessions) seal(token string) (*http.Cookie, error) {
	plain, err := json.Marshal(session{Token: token, Expires: s.now().Add(sessionAge)})
	if err != nil {
		return nil, err
	}
	nonce := make([]byte, s.aead.NonceSize())
	if _, err := rand.Read(nonce); err != nil {
		return nil, err
	}
	sealed := s.aead.Seal(nonce, nonce, plain, []byte(s.name()))
	return s.cookie(base64.RawURLEncoding.EncodeToString(sealed), sessionAge), nil
}

// token returns the token of a signed-in browser, or "".
func (s *sessions) token(r *http.Request) string {
	cookie, err := r.Cookie(s.name())
	if err != nil {
		return ""
	}
	sealed, err := base64.RawURLEncoding.DecodeString(cookie.Value)
	if err != nil || len(sealed) < s.aead.NonceSize() {
		return ""
	}
	nonce, sealed := sealed[:s.aead.NonceSize()], sealed[s.aead.NonceSize():]
	plain, err := s.aead.Open(nil, nonce, sealed, []byte(s.name()))
	if err != nil {
		return ""
	}
	var opened session
	if json.Unmarshal(plain, &opened) != nil || !s.now().Before(opened.Expires) {
		return ""
	}
	return opened.Token
}

// signIn gives calls of a signed-in browser the token of its session. A token that the call has itself wins.
// A page of another origin never acts for the session, even if --allowed_host lets it call.
func (s *sessions) signIn(next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if r.Header.Get("Authorization") == "" && isOwnOrigin(r) {
			if token := s.token(r); token != "" {
				r.Header.Set("Authorization", "Bearer "+token)
			}
		}
		// The server has no use for it.
		r.Header.Del("Cookie")
		next.ServeHTTP(w, r)
	})
}

// isOwnOrigin tells whether a page of this gateway, or no page, has sent the request.
func isOwnOrigin(r *http.Request) bool {
	switch r.Header.Get("Sec-Fetch-Site") {
	case "same-origin", "none":
		return true
	case "":
		origin := r.Header.Get("Origin")
		return origin == "" || strings.HasSuffix(origin, "://"+r.Host)
	}
	return false
}

// handle serves sessionPath: POST {"token": "..."} signs in, DELETE signs out. Who is signed in is a question to
// the server: AccessService.GetCaller.
func (s *sessions) handle(mux *http.ServeMux, server *upstream) {
	caller := connect.NewClient[message, message](server.client,
		server.url+"/hypermap.v1.AccessService/GetCaller", connect.WithGRPC(), connect.WithCodec(binaryCodec{}))
	mux.HandleFunc("POST "+sessionPath, func(w http.ResponseWriter, r *http.Request) {
		token, err := readToken(w, r)
		if err != nil {
			http.Error(w, err.Error(), http.StatusBadRequest)
			return
		}
		request := connect.NewRequest(&message{})
		request.Header().Set("Authorization", "Bearer "+token)
		if _, err := caller.CallUnary(r.Context(), request); err != nil {
			refuseSignIn(w, err)
			return
		}
		cookie, err := s.seal(token)
		if err != nil {
			http.Error(w, "the session can't be made", http.StatusInternalServerError)
			return
		}
		http.SetCookie(w, cookie)
		w.WriteHeader(http.StatusNoContent)
	})
	mux.HandleFunc("DELETE "+sessionPath, func(w http.ResponseWriter, _ *http.Request) {
		http.SetCookie(w, s.cookie("", -time.Second))
		w.WriteHeader(http.StatusNoContent)
	})
}

func readToken(w http.ResponseWriter, r *http.Request) (string, error) {
	// Forms of other sites can't send this type.
	if !strings.HasPrefix(r.Header.Get("Content-Type"), "application/json") {
		return "", errors.New("the content type is not application/json")
	}
	var body struct {
		Token string `json:"token"`
	}
	decoder := json.NewDecoder(http.MaxBytesReader(w, r.Body, maxTokenBytes))
	decoder.DisallowUnknownFields()
	if err := decoder.Decode(&body); err != nil {
		return "", errors.New("the body is not {\"token\": \"...\"}")
	}
	if _, err := decoder.Token(); !errors.Is(err, io.EOF) || body.Token == "" || strings.ContainsAny(body.Token, "\r\n") {
		return "", errors.New("the body is not {\"token\": \"...\"}")
	}
	return body.Token, nil
}

// refuseSignIn tells why, without the token.
func refuseSignIn(w http.ResponseWriter, err error) {
	switch connect.CodeOf(err) {
	case connect.CodeUnauthenticated, connect.CodePermissionDenied:
		http.Error(w, "the token is not known, or has expired", http.StatusUnauthorized)
	case connect.CodeResourceExhausted:
		http.Error(w, "too many attempts", http.StatusTooManyRequests)
	default:
		http.Error(w, "the server can't be asked", http.StatusBadGateway)
	}
}
