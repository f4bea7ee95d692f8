package recorder

import (
	"context"
	"errors"
	"io"
	"net"
	"strings"
	"time"

	"google.golang.org/grpc"
	"google.golang.org/grpc/backoff"
	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/credentials/insecure"
	"google.golang.org/grpc/status"
	"google.golang.org/protobuf/types/dynamicpb"
)

// connection is a gRPC connection to the server, also after it was restarted on another port.
type connection struct {
	schema  *schema
	channel *grpc.ClientConn
}

// connect returns a connection that asks for the server's address whenever it is established anew.
func connect(s *schema, address func() string) (*connection, error) {
	dial := func(ctx context.Context, _ string) (net.Conn, error) {
		return (&net.Dialer{}).DialContext(ctx, "tcp", address())
	}
	channel, err := grpc.NewClient("passthrough:///hypermapd",
		grpc.WithContextDialer(dial),
		grpc.WithTransportCredentials(insecure.NewCredentials()),
		// A call that is begun while the server is down waits for it.
		grpc.WithDefaultCallOptions(grpc.WaitForReady(true)),
		// A server is down for some tenths of a second only.
		grpc.WithConnectParams(grpc.ConnectParams{
			Backoff: backoff.Config{
				BaseDelay: 5 * time.Millisecond, Multiplier: 1.5, Jitter: 0.2, MaxDelay: 50 * time.Millisecond,
			},
			MinConnectTimeout: 5 * time.Second,
		}))
	if err != nil {
		return nil, err
	}
	return &connection{s, channel}, nil
}

func (c *connection) close() { _ = c.channel.Close() }

// call makes a call, such as of "QueryService.QueryArea", and passes each message of the answer to
// `receive`.
func (c *connection) call(ctx context.Context, rpc string, fields object, receive func(*dynamicpb.Message) error) error {
	method, err := c.schema.method(rpc)
	if err != nil {
		return err
	}
	request, err := encode(method.Input(), fields)
	if err != nil {
		return err
	}
	// The end of this context frees a stream that is not read to its end.
	ctx, cancel := context.WithCancel(ctx)
	defer cancel()
	path := "/hypermap.v1." + strings.Replace(rpc, ".", "/", 1)
	stream, err := c.channel.NewStream(ctx, &grpc.StreamDesc{ServerStreams: true}, path)
	if err != nil {
		return err
	}
	// After io.EOF the error of the call is what RecvMsg returns.
	if err := stream.SendMsg(request); err != nil && !errors.Is(err, io.EOF) {
		return err
	}
	if err := stream.CloseSend(); err != nil {
		return err
	}
	for {
		message := dynamicpb.NewMessage(method.Output())
		if err := stream.RecvMsg(message); errors.Is(err, io.EOF) {
			return nil
		} else if err != nil {
			return err
		}
		if err := receive(message); err != nil {
			return err
		}
	}
}

// change makes a change that has a request id, also if the server can't for a while, or is at opening the map
// that an earlier attempt has made.
func (c *connection) change(ctx context.Context, rpc string, fields object) error {
	ctx, cancel := context.WithTimeout(ctx, startDeadline)
	defer cancel()
	for {
		var ignored struct{}
		err := c.callOnce(ctx, rpc, fields, &ignored)
		if code := status.Code(err); code != codes.Unavailable && code != codes.Aborted {
			return err
		}
		if pause(ctx, spread.pause) != nil {
			return err
		}
	}
}

// callOnce makes a call whose answer is one message, and decodes it into a struct.
func (c *connection) callOnce(ctx context.Context, rpc string, fields object, answer any) error {
	return c.call(ctx, rpc, fields, func(message *dynamicpb.Message) error { return decode(message, answer) })
}
