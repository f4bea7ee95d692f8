package main

import (
	"bytes"
	"fmt"

	"google.golang.org/protobuf/encoding/protojson"
	"google.golang.org/protobuf/proto"
	"google.golang.org/protobuf/reflect/protoreflect"
	"google.golang.org/protobuf/types/dynamicpb"
)

// message is a request or an answer in Protobuf's binary format. It is forwarded without being parsed
// if the caller uses that format too.
type message struct {
	binary []byte
	// The type of the message, which only jsonCodec needs.
	schema protoreflect.MessageDescriptor
}

// binaryCodec copies messages without parsing them. Connect also uses it for the details of errors,
// which are ordinary Protobuf messages.
type binaryCodec struct{}

func (binaryCodec) Name() string { return "proto" }

func (binaryCodec) Marshal(value any) ([]byte, error) {
	switch value := value.(type) {
	case *message:
		return value.binary, nil
	case proto.Message:
		return proto.Marshal(value)
	}
	return nil, fmt.Errorf("not a message: %T", value)
}

func (binaryCodec) Unmarshal(data []byte, value any) error {
	switch value := value.(type) {
	case *message:
		value.binary = bytes.Clone(data) // Connect reuses its buffer.
		return nil
	case proto.Message:
		return proto.Unmarshal(data, value)
	}
	return fmt.Errorf("not a message: %T", value)
}

// jsonCodec converts messages from and to JSON, for callers without Protobuf such as curl.
type jsonCodec struct{}

func (jsonCodec) Name() string { return "json" }

func (jsonCodec) Marshal(value any) ([]byte, error) {
	answer, ok := value.(*message)
	if !ok {
		return nil, fmt.Errorf("not a message: %T", value)
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
		return fmt.Errorf("not a message: %T", value)
	}
	parsed := dynamicpb.NewMessage(request.schema)
	if err := protojson.Unmarshal(data, parsed); err != nil {
		return err
	}
	var err error
	request.binary, err = proto.Marshal(parsed)
	return err
}
