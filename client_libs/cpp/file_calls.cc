// File calls of Client: import, export, backup, check, digest, restoration.
#include <algorithm>
#include <istream>
#include <memory>
#include <string>
#include <utility>

#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/grpc_part_stream.h"
#include "wire/catalog.h"
#include "wire/file_format.h"

namespace hypermap::client {
namespace {

// Well below gRPC's default limit of 4 MiB for a message.
constexpr size_t kChunkBytes = size_t{1} << 20;

// Sends a file in at least one chunk. Returns false if the server accepts no more; the status of
// the call then says why.
bool SendFile(const NamedFile& file, grpc::ClientWriter<v1::ImportMapRequest>& writer) {
  size_t sent = 0;
  do {
    const size_t size = std::min(kChunkBytes, file.data.size() - sent);
    v1::ImportMapRequest message;
    message.mutable_chunk()->set_file_name(file.name);
    message.mutable_chunk()->set_data(file.data.data() + sent, size);
    if (!writer.Write(message)) return false;
    sent += size;
  } while (sent < file.data.size());
  return true;
}

// One attempt of an import.
grpc::Status SendFiles(v1::CatalogService::Stub& catalog, grpc::ClientContext& context,
                       const v1::ImportMapRequest& first, const std::vector<NamedFile>& files,
                       v1::ImportMapResponse* response) {
  response->Clear();
  const std::unique_ptr<grpc::ClientWriter<v1::ImportMapRequest>> writer =
      catalog.ImportMap(&context, response);
  bool sending = writer->Write(first);
  for (size_t i = 0; sending && i < files.size(); ++i) sending = SendFile(files[i], *writer);
  writer->WritesDone();
  return writer->Finish();
}

// One attempt of an export.
grpc::Status ReceiveFiles(v1::CatalogService::Stub& catalog, grpc::ClientContext& context,
                          const v1::ExportMapRequest& request, ExportAnswer& answer) {
  const auto reader = catalog.ExportMap(&context, request);
  answer = {};
  v1::ExportMapResponse message;
  while (reader->Read(&message)) {
    if (message.has_header()) {
      const v1::ExportHeader& header = message.header();
      answer.map = header.map();
      answer.revision = header.revision();
      answer.incarnation = header.incarnation();
      answer.omissions.assign(header.omissions().begin(), header.omissions().end());
    } else if (message.has_chunk()) {
      const v1::FileChunk& chunk = message.chunk();
      if (answer.files.empty() || answer.files.back().name != chunk.file_name()) {
        answer.files.push_back({chunk.file_name(), ""});
      }
      answer.files.back().data += chunk.data();
    }
  }
  return reader->Finish();
}

// One attempt of a restoration.
grpc::Status SendBackup(v1::CatalogService::Stub& catalog, grpc::ClientContext& context,
                        const v1::RestoreMapRequest& first, std::istream& backup,
                        v1::RestoreMapResponse* response) {
  response->Clear();
  backup.clear();
  backup.seekg(0);
  const std::unique_ptr<grpc::ClientWriter<v1::RestoreMapRequest>> writer =
      catalog.RestoreMap(&context, response);
  bool sending = writer->Write(first);
  while (sending && backup) {
    v1::RestoreMapRequest message;
    std::string& data = *message.mutable_data();
    data.resize(kChunkBytes);
    backup.read(data.data(), kChunkBytes);
    data.resize(static_cast<size_t>(backup.gcount()));
    if (!data.empty()) sending = writer->Write(message);
  }
  if (backup.bad()) context.TryCancel();
  writer->WritesDone();
  return writer->Finish();
}

absl::StatusOr<std::string> TakeBytes(v1::BackupMapResponse&& message) {
  return std::move(*message.mutable_data());
}

}  // namespace

absl::StatusOr<ImportAnswer> Client::ImportMap(const std::string& map, FileFormat format,
                                               const std::vector<NamedFile>& files,
                                               const ImportOptions& import_options,
                                               const CallOptions& options) {
  v1::ImportMapRequest first;
  v1::ImportHeader& header = *first.mutable_header();
  header.set_map(map);
  header.set_format(wire::EncodeFileFormat(format));
  header.set_layer(import_options.layer);
  header.set_frame_id(import_options.frame_id);
  header.set_create_map(import_options.create_map);
  header.set_request_id(RequestIdOf(options));
  header.set_incarnation(options.incarnation);

  v1::ImportMapResponse response;
  const absl::Status status =
      connection_->Retry(options, [&](Server& server, grpc::ClientContext& context) {
        return SendFiles(server.stub<v1::CatalogService::Stub>(), context, first, files, &response);
      });
  if (!status.ok()) return status;
  connection_->Note(map, response);
  return ImportAnswer{response.map(),
                      response.revision(),
                      {response.layers().begin(), response.layers().end()},
                      {response.repairs().begin(), response.repairs().end()},
                      response.incarnation()};
}

absl::StatusOr<ExportAnswer> Client::ExportMap(const std::string& map, FileFormat format,
                                               const ExportOptions& export_options,
                                               const CallOptions& options) {
  v1::ExportMapRequest request;
  request.set_map(map);
  request.set_format(wire::EncodeFileFormat(format));
  request.mutable_layers()->Assign(export_options.layers.begin(), export_options.layers.end());
  request.set_image_format(export_options.image == ImageFormat::kPng ? "png" : "pgm");
  ExportAnswer answer;
  const absl::Status status =
      connection_->Retry(options, [&](Server& server, grpc::ClientContext& context) {
        return ReceiveFiles(server.stub<v1::CatalogService::Stub>(), context, request, answer);
      });
  if (!status.ok()) return status;
  return answer;
}

ByteReader Client::BackupMap(const std::string& map, const CallOptions& options) {
  v1::BackupMapRequest request;
  request.set_map(map);
  return ByteReader(MakeGrpcPartStream(connection_, &v1::CatalogService::Stub::BackupMap,
                                       std::move(request), options, &TakeBytes));
}

absl::StatusOr<CheckReport> Client::CheckMap(const std::string& map, const CallOptions& options) {
  v1::CheckMapRequest request;
  request.set_map(map);
  const absl::StatusOr<v1::CheckMapResponse> response =
      connection_->Call(&v1::CatalogService::Stub::CheckMap, request, options);
  if (!response.ok()) return response.status();
  return wire::DecodeCheckReport(*response);
}

absl::StatusOr<DigestAnswer> Client::DigestMap(const std::string& map, const CallOptions& options) {
  v1::DigestMapRequest request;
  request.set_map(map);
  const absl::StatusOr<v1::DigestMapResponse> response =
      connection_->Call(&v1::CatalogService::Stub::DigestMap, request, options);
  if (!response.ok()) return response.status();
  DigestAnswer answer{
      response->map(), wire::DecodeContentDigest(*response), {}, response->incarnation()};
  for (const v1::LayerDigest& layer : response->layers()) {
    answer.layer_versions[layer.layer()] = layer.version();
  }
  return answer;
}

absl::StatusOr<MapEntry> Client::RestoreMap(const std::string& map, std::istream& backup,
                                            bool replace, const CallOptions& options) {
  v1::RestoreMapRequest first;
  v1::RestoreHeader& header = *first.mutable_header();
  header.set_map(map);
  header.set_replace(replace);
  header.set_request_id(RequestIdOf(options));
  header.set_incarnation(options.incarnation);
  v1::RestoreMapResponse response;
  const absl::Status status = connection_->Retry(options, [&](Server& server,
                                                              grpc::ClientContext& context) {
    return SendBackup(server.stub<v1::CatalogService::Stub>(), context, first, backup, &response);
  });
  if (backup.bad()) return absl::DataLossError("the backup can't be read");
  if (!status.ok()) return status;
  return wire::DecodeMapEntry(response.map());
}

}  // namespace hypermap::client
