package main

import (
	"google.golang.org/protobuf/encoding/protowire"
	"google.golang.org/protobuf/reflect/protoreflect"
)

const (
	// copiesOfJSON is the number of times that the JSON of an answer is in memory while it is written: a
	// buffer that grows by doubling, and a compressed copy.
	copiesOfJSON = 4
	// nameBytes is the JSON of a field without its name and value: quotes, colon, comma and two spaces.
	nameBytes = 6
	// elementText is a comma and a space.
	elementText = 2
	// deepest is the depth at which messages are no longer looked into.
	deepest = 100
)

// jsonAnswerBytes returns the memory that it takes to parse an encoded message and to write it as JSON, at
// most.
func jsonAnswerBytes(binary []byte, schema protoreflect.MessageDescriptor) int64 {
	scan := answerScanner{}
	scan.message(binary, schema, 0)
	return scan.parsed + copiesOfJSON*scan.text
}

// answerScanner adds up the memory of a parsed message, and the length of its JSON.
type answerScanner struct{ parsed, text int64 }

func (s *answerScanner) message(binary []byte, schema protoreflect.MessageDescriptor, depth int) {
	s.parsed += objectBytes
	s.text += 2
	if depth > deepest {
		s.parsed += objectBytes * int64(len(binary))
		s.text += int64(len(binary))
		return
	}
	for len(binary) > 0 {
		number, kind, n := protowire.ConsumeTag(binary)
		if n < 0 {
			return // proto.Unmarshal ends here as well.
		}
		value := protowire.ConsumeFieldValue(number, kind, binary[n:])
		if value < 0 {
			return
		}
		field := schema.Fields().ByNumber(number)
		if field == nil {
			s.parsed += int64(n + value) // It is kept, and not written as JSON.
		} else {
			s.field(field, kind, binary[n:n+value], depth)
		}
		binary = binary[n+value:]
	}
}

func (s *answerScanner) field(field protoreflect.FieldDescriptor, kind protowire.Type, value []byte, depth int) {
	if field.IsList() {
		s.parsed += elementBytes
	}
	s.parsed += entryBytes
	s.text += int64(len(field.JSONName())) + nameBytes
	if kind != protowire.BytesType {
		s.text += numberText(field)
		return
	}
	content, _ := protowire.ConsumeBytes(value)
	switch field.Kind() {
	case protoreflect.MessageKind, protoreflect.GroupKind:
		s.message(content, field.Message(), depth+1)
	case protoreflect.StringKind:
		s.parsed += int64(len(content))
		s.text += textOf(content)
	case protoreflect.BytesKind:
		s.parsed += int64(len(content))
		s.text += int64(len(content))*4/3 + 6
	default: // A packed list.
		elements := int64(len(content))
		switch field.Kind() {
		case protoreflect.DoubleKind, protoreflect.Fixed64Kind, protoreflect.Sfixed64Kind:
			elements /= 8
		case protoreflect.FloatKind, protoreflect.Fixed32Kind, protoreflect.Sfixed32Kind:
			elements /= 4
		default:
			elements = varintsIn(content)
		}
		s.parsed += elements * elementBytes
		s.text += elements * (numberText(field) + elementText)
	}
}

// varintsIn counts the varints of a packed list.
func varintsIn(packed []byte) int64 {
	var count int64
	for _, b := range packed {
		if b < 0x80 {
			count++
		}
	}
	return count
}

// numberText returns the longest JSON of a value that is no text and no message.
func numberText(field protoreflect.FieldDescriptor) int64 {
	switch field.Kind() {
	case protoreflect.BoolKind:
		return 5
	case protoreflect.EnumKind:
		longest := 11
		for i := range field.Enum().Values().Len() {
			longest = max(longest, len(field.Enum().Values().Get(i).Name())+2)
		}
		return int64(longest)
	}
	return 26 // A double, or an integer of 64 bits in quotes.
}

// textOf returns the length of a string in JSON.
func textOf(content []byte) int64 {
	length := int64(len(content)) + 2
	for _, c := range content {
		switch {
		case c < ' ':
			length += 5
		case c == '"', c == '\\':
			length++
		}
	}
	return length
}
