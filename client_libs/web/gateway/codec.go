package main

import (
	"bytes"
	"fmt"

	"google.golang.org/protobuf/encoding/protojson"
	"google.golang.org/protobuf/proto"
	"google.golang.org/protobuf/reflect/protoreflect"
	"google.golang.org/protobuf/types/dynamicpb"
)

// message is a request or an answer in Protobuf's binary form. Between two sides that both use that
// form it passes unread.
type message struct {
	binary []byte
	// Wanted for JSON only.
	schema protoreflect.MessageDescriptor
}

// binaryCodec reads and writes messages as they are. Connect also gives it the details of errors, which
// are ordinary Protobuf messages.
type binaryCodec struct{}

func (binaryCodec) Name() string { return "proto" }

func (binaryCodec) Marshal(value any) ([]byte, error) {
	switch value := value.(type) {
	case *message:
		return value.binary, nil
	case proto.Message:
		return proto.Marshal(value)
	}
	return nil, fmt.Errorf("no message: %T", value)
}

func (binaryCodec) Unmarshal(data []byte, value any) error {
	switch value := value.(type) {
	case *message:
		value.binary = bytes.Clone(data) // Connect uses its buffer again.
		return nil
	case proto.Message:
		return proto.Unmarshal(data, value)
	}
	return fmt.Errorf("no message: %T", value)
}

// jsonCodec is for callers without Protobuf, such as curl.
type jsonCodec struct{}

func (jsonCodec) Name() string { return "json" }

func (jsonCodec) Marshal(value any) ([]byte, error) {
	answer, ok := value.(*message)
	if !ok {
		return nil, fmt.Errorf("no message: %T", value)
	}
	parsed := dynamicpb.NewMessage(answer.schema)
	if err := proto.Unmarshal(answer.binary, parsed); err != nil {
		return nil, err
	}
	return protojson.Marshal(parsed)
}

func (jsonCodec) Unmarshal(data []byte, value any) error {
	request, ok := value.(*message)
	if !ok {
		return fmt.Errorf("no message: %T", value)
	}
	parsed := dynamicpb.NewMessage(request.schema)
	if err := protojson.Unmarshal(data, parsed); err != nil {
		return err
	}
	var err error
	request.binary, err = proto.Marshal(parsed)
	return err
}
