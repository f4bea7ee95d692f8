package main

// Upper bounds of the memory of a parsed JSON document besides its text, for each character that begins a
// value: "{", "[", ":" and ",". A message is two maps and a struct; an element of a list is a value of 24 bytes, in a slice that is copied
// when it grows. The encoded message is counted with them.
const (
	objectBytes  = 512
	listBytes    = 128
	entryBytes   = 128
	elementBytes = 80
)

// jsonScanner estimates the memory that a JSON document takes when it is parsed, without parsing it. The
// zero value is ready for a document.
type jsonScanner struct {
	inString bool
	escaped  bool
}

// parsedBytes returns the memory for the next part of the document.
func (s *jsonScanner) parsedBytes(part []byte) int64 {
	var bytes int64
	for _, c := range part {
		switch {
		case s.escaped:
			s.escaped = false
		case c == '"':
			s.inString = !s.inString
		case s.inString:
			s.escaped = c == '\\'
		case c == '{':
			bytes += objectBytes
		case c == '[':
			bytes += listBytes
		case c == ':':
			bytes += entryBytes
		case c == ',':
			bytes += elementBytes
		}
	}
	return bytes
}
