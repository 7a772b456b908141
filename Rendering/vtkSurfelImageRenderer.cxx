// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelImageRenderer.h"

#include "Core/Base/LinearLight.h"
#include "Rendering/Scene/SceneView.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtkActor.h>
#include <vtkActorCollection.h>
#include <vtkCamera.h>
#include <vtkDemandDrivenPipeline.h>
#include <vtkExecutive.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationExecutivePortVectorKey.h>
#include <vtkInformationVector.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMatrix4x4.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkSMPTools.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTrivialProducer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

vtkStandardNewMacro(vtkSurfelImageRenderer);

vtkSurfelImageRenderer::vtkSurfelImageRenderer()
{
  this->SetNumberOfInputPorts(1);
  this->SetNumberOfOutputPorts(2);
  vtkNew<vtkLight> headlight;
  headlight->SetLightTypeToHeadlight();
  this->Headlight->AddItem(headlight);
}

vtkSurfelImageRenderer::~vtkSurfelImageRenderer() = default;

void vtkSurfelImageRenderer::AddActor(vtkActor* actor)
{
  if (!actor || this->Actors->IsItemPresent(actor))
  {
    return;
  }
  if (!vtkSurfelMapper::SafeDownCast(actor->GetMapper()))
  {
    vtkWarningMacro("An actor whose mapper is not a vtkSurfelMapper is not drawn: meshes and other "
                    "props need a window and vtkSurfelSplattingPass.");
    return;
  }
  this->Actors->AddItem(actor);
  this->Modified();
}

void vtkSurfelImageRenderer::RemoveActor(vtkActor* actor)
{
  this->Actors->RemoveItem(actor);
  this->Modified();
}

void vtkSurfelImageRenderer::RemoveAllActors()
{
  this->Actors->RemoveAllItems();
  this->Modified();
}

vtkActorCollection* vtkSurfelImageRenderer::GetActors()
{
  return this->Actors;
}

void vtkSurfelImageRenderer::AddLight(vtkLight* light)
{
  if (light && !this->Lights->IsItemPresent(light))
  {
    this->Lights->AddItem(light);
    this->Modified();
  }
}

void vtkSurfelImageRenderer::RemoveAllLights()
{
  this->Lights->RemoveAllItems();
  this->Modified();
}

vtkLightCollection* vtkSurfelImageRenderer::GetLights()
{
  return this->Lights;
}

void vtkSurfelImageRenderer::SetCamera(vtkCamera* camera)
{
  if (this->Camera != camera)
  {
    this->Camera = camera;
    this->Modified();
  }
}

vtkCamera* vtkSurfelImageRenderer::GetCamera()
{
  return this->Camera;
}

void vtkSurfelImageRenderer::SetSize(int width, int height)
{
  if (width < 1 || height < 1 || width > 65536 || height > 65536)
  {
    vtkErrorMacro("A picture of " << width << " x " << height
                                  << " pixels cannot be made: each side must be in [1, 65536].");
    return;
  }
  if (this->Size[0] != width || this->Size[1] != height)
  {
    this->Size[0] = width;
    this->Size[1] = height;
    this->Modified();
  }
}

vtkSurfelSplatter* vtkSurfelImageRenderer::GetSplatter()
{
  return this->Splatter;
}

vtkMTimeType vtkSurfelImageRenderer::GetMTime()
{
  vtkMTimeType time = std::max(this->Superclass::GetMTime(), this->Splatter->GetMTime());
  if (this->Camera)
  {
    time = std::max(time, this->Camera->GetMTime());
  }
  vtkCollectionSimpleIterator it;
  this->Actors->InitTraversal(it);
  while (vtkActor* actor = this->Actors->GetNextActor(it))
  {
    // The mapper's input is updated here, since no pipeline connects it to this algorithm.
    time = std::max(time, actor->GetRedrawMTime());
    vtkSurfelMapper* mapper = vtkSurfelMapper::SafeDownCast(actor->GetMapper());
    if (mapper && mapper->GetInputAlgorithm() && !mapper->GetStatic())
    {
      mapper->GetInputAlgorithm()->Update();
      time = std::max(time, mapper->GetInput() ? mapper->GetInput()->GetMTime() : 0);
    }
  }
  this->Lights->InitTraversal(it);
  while (vtkLight* light = this->Lights->GetNextLight(it))
  {
    time = std::max(time, light->GetMTime());
  }
  return time;
}

bool vtkSurfelImageRenderer::HasPicture(vtkInformation* output)
{
  auto* pipeline = vtkDemandDrivenPipeline::SafeDownCast(this->GetExecutive());
  vtkDataObject* picture = output->Get(vtkDataObject::DATA_OBJECT());
  return pipeline && picture && picture->GetUpdateTime() > pipeline->GetPipelineMTime();
}

vtkTypeBool vtkSurfelImageRenderer::ProcessRequest(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA_NOT_GENERATED()))
  {
    vtkInformation* picture = outputVector->GetInformationObject(0);
    vtkInformation* bytes = outputVector->GetInformationObject(1);
    const int port = request->Get(vtkDemandDrivenPipeline::FROM_OUTPUT_PORT());
    if (port == 1 && this->HasPicture(picture))
    {
      picture->Set(vtkDemandDrivenPipeline::DATA_NOT_GENERATED(), 1);
    }
    // To round takes a twentieth of a sharp frame. VTK's image writers update the first output,
    // whichever they are connected to.
    if (port == 0 && vtkExecutive::CONSUMERS()->Length(bytes) == 0)
    {
      bytes->Set(vtkDemandDrivenPipeline::DATA_NOT_GENERATED(), 1);
    }
  }
  return this->Superclass::ProcessRequest(request, inputVector, outputVector);
}

int vtkSurfelImageRenderer::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  info->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
  return 1;
}

int vtkSurfelImageRenderer::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  const int extent[6] = { 0, this->Size[0] - 1, 0, this->Size[1] - 1, 0, 0 };
  for (int port = 0; port < 2; ++port)
  {
    vtkInformation* info = outputVector->GetInformationObject(port);
    info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
  }
  vtkDataObject::SetPointDataActiveScalarInfo(outputVector->GetInformationObject(0), VTK_FLOAT, 4);
  vtkDataObject::SetPointDataActiveScalarInfo(
    outputVector->GetInformationObject(1), VTK_UNSIGNED_CHAR, 3);
  return 1;
}

void vtkSurfelImageRenderer::AddInputs(
  vtkInformationVector* inputs, vtkSurfelSplatter::SceneItems& items)
{
  // The mappers are kept: they hold data of their hierarchies.
  this->InputMappers.resize(static_cast<std::size_t>(inputs->GetNumberOfInformationObjects()));
  for (std::size_t i = 0; i < this->InputMappers.size(); ++i)
  {
    vtkSmartPointer<vtkSurfelMapper>& mapper = this->InputMappers[i];
    mapper = mapper ? mapper : vtkSmartPointer<vtkSurfelMapper>::New();
    vtkPolyData* data = vtkPolyData::GetData(inputs, static_cast<int>(i));
    if (mapper->GetInput() != data)
    {
      vtkNew<vtkTrivialProducer> producer;
      producer->SetOutput(data);
      mapper->SetInputConnection(producer->GetOutputPort());
    }
    SurfelSplatting::SceneItem item;
    item.Mapper = mapper;
    item.Matrix = vtkSmartPointer<vtkMatrix4x4>::New();
    item.Property = vtkSmartPointer<vtkProperty>::New();
    item.Property->LightingOff();
    items.push_back(item);
  }
}

SurfelSplatting::SceneView vtkSurfelImageRenderer::MakeView(
  const vtkSurfelSplatter::SceneItems& items)
{
  SurfelSplatting::SceneView view;
  view.Camera = this->Camera;
  view.Lights = this->Lights->GetNumberOfItems() > 0 ? this->Lights.Get() : this->Headlight.Get();
  std::copy_n(this->Size, 2, view.Size);
  view.Aspect = static_cast<double>(this->Size[0]) / this->Size[1];
  this->Camera->GetClippingRange(view.ClippingRange);
  if (this->AutomaticClippingRange)
  {
    // Only what is at the lens itself has no image. Unlike in OpenGL, a small near limit costs no
    // precision.
    view.ClippingRange[0] =
      this->Camera->GetParallelProjection() ? -VTK_DOUBLE_MAX : 1e-6 * this->Camera->GetDistance();
    view.ClippingRange[1] = VTK_DOUBLE_MAX;
  }
  view.Progress = [this](double done) {
    this->UpdateProgress(done);
    return this->GetAbortExecute() == 0;
  };
  this->Splatter->CompleteView(view, items);
  return view;
}

int vtkSurfelImageRenderer::RequestData(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  const auto isWanted = [outputVector](int port) {
    return !outputVector->GetInformationObject(port)->Has(
      vtkDemandDrivenPipeline::DATA_NOT_GENERATED());
  };
  vtkImageData* picture = vtkImageData::GetData(outputVector);
  if (isWanted(0) && !this->Draw(inputVector[0], picture))
  {
    return 0;
  }
  vtkImageData* bytes = vtkImageData::GetData(outputVector, 1);
  if (isWanted(1))
  {
    this->RoundToBytes(picture, bytes);
  }
  else
  {
    bytes->Initialize(); // rather than the last picture
  }
  return 1;
}

bool vtkSurfelImageRenderer::Draw(vtkInformationVector* inputs, vtkImageData* picture)
{
  if (!this->Camera)
  {
    vtkErrorMacro("There is no camera: call SetCamera().");
    return false;
  }
  vtkSurfelSplatter::SceneItems items;
  vtkCollectionSimpleIterator it;
  this->Actors->InitTraversal(it);
  while (vtkActor* actor = this->Actors->GetNextActor(it))
  {
    vtkSurfelSplatter::CollectItems(actor, items);
  }
  this->AddInputs(inputs, items);
  if (!this->Splatter->Render(items, this->MakeView(items)))
  {
    return false;
  }
  picture->ShallowCopy(this->Splatter->GetOutput());
  this->BlendBackground(picture);
  return true;
}

void vtkSurfelImageRenderer::RoundToBytes(vtkImageData* picture, vtkImageData* bytes)
{
  bytes->CopyStructure(picture);
  auto* color = vtkFloatArray::SafeDownCast(picture->GetPointData()->GetScalars());
  vtkNew<vtkUnsignedCharArray> codes;
  codes->SetName("Color8");
  codes->SetNumberOfComponents(3);
  codes->SetNumberOfTuples(color->GetNumberOfTuples());
  bytes->GetPointData()->SetScalars(codes);
  const bool isLight = this->Splatter->GetLinearLight();
  const float* from = color->GetPointer(0);
  unsigned char* to = codes->GetPointer(0);
  vtkSMPTools::For(0, color->GetNumberOfTuples(), [=](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      for (int c = 0; c < 3; ++c)
      {
        const float value = from[4 * i + c];
        const float code =
          isLight ? static_cast<float>(SurfelSplatting::CodeOfLight(value)) : value;
        to[3 * i + c] =
          static_cast<unsigned char>(std::min(255.0f, std::max(0.0f, 255.0f * code + 0.5f)));
      }
    }
  });
}

void vtkSurfelImageRenderer::BlendBackground(vtkImageData* picture)
{
  if (this->BackgroundAlpha <= 0.0)
  {
    return;
  }
  // A copy: the output of the splatter keeps no background.
  auto* seen = vtkFloatArray::SafeDownCast(picture->GetPointData()->GetScalars());
  vtkNew<vtkFloatArray> blended;
  blended->SetName(seen->GetName());
  blended->SetNumberOfComponents(4);
  blended->SetNumberOfTuples(seen->GetNumberOfTuples());
  picture->GetPointData()->SetScalars(blended);
  const double a = this->BackgroundAlpha;
  float under[4] = { 0.0f, 0.0f, 0.0f, static_cast<float>(a) };
  for (int c = 0; c < 3; ++c)
  {
    const double color = this->Background[c];
    under[c] = static_cast<float>(
      a * (this->Splatter->GetLinearLight() ? SurfelSplatting::LightOfCode(color) : color));
  }
  const float* from = seen->GetPointer(0);
  float* to = blended->GetPointer(0);
  vtkSMPTools::For(0, seen->GetNumberOfTuples(), [&under, from, to](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      const float* rgba = from + 4 * i;
      const float through = 1.0f - rgba[3];
      for (int c = 0; c < 4; ++c)
      {
        to[4 * i + c] = rgba[c] + through * under[c];
      }
    }
  });
}

void vtkSurfelImageRenderer::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Size: " << this->Size[0] << " x " << this->Size[1] << "\n";
  os << indent << "Background: " << this->Background[0] << ", " << this->Background[1] << ", "
     << this->Background[2] << ", " << this->BackgroundAlpha << "\n";
  os << indent << "AutomaticClippingRange: " << this->AutomaticClippingRange << "\n";
  os << indent << "Camera: " << this->Camera.Get() << "\n";
  os << indent << "Actors: " << this->Actors->GetNumberOfItems() << "\n";
  os << indent << "Lights: " << this->Lights->GetNumberOfItems() << "\n";
  os << indent << "Splatter:\n";
  this->Splatter->PrintSelf(os, indent.GetNextIndent());
}
