"""Tiny checkpoints of the real classes, with random weights, written as published ones are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

PIXELS = 64
LETTERS = "abcdefghijklmnopqrstuvwxyz0123456789"


def libraries() -> tuple[Any, Any]:
    """torch and transformers; a test is skipped where one of them is missing."""
    torch = pytest.importorskip("torch", reason="the extra [vision] is not installed")
    transformers = pytest.importorskip("transformers", reason="the extra [vision] is not installed")
    torch.manual_seed(0)
    return torch, transformers


def grounding_dino(path: Path, text_length: int = 64) -> Path:
    """A Grounding DINO of one layer each; the ids of its marks are those of BERT, as it wants."""
    _, transformers = libraries()
    config = transformers.GroundingDinoConfig(
        backbone_config=transformers.SwinConfig(
            image_size=PIXELS,
            embed_dim=16,
            depths=[1, 1, 1, 1],
            num_heads=[1, 1, 2, 2],
            window_size=2,
            out_indices=[2, 3, 4],
        ),
        text_config=transformers.BertConfig(
            vocab_size=1100,
            hidden_size=16,
            num_hidden_layers=1,
            num_attention_heads=2,
            intermediate_size=32,
        ),
        d_model=32,
        encoder_layers=1,
        encoder_ffn_dim=32,
        encoder_attention_heads=2,
        decoder_layers=2,
        decoder_ffn_dim=32,
        decoder_attention_heads=2,
        num_queries=20,
        max_text_len=text_length,
    )
    transformers.GroundingDinoForObjectDetection(config).save_pretrained(path)
    marks = {0: "[PAD]", 100: "[UNK]", 101: "[CLS]", 102: "[SEP]", 103: "[MASK]", 1012: "."}
    pieces = [*LETTERS, *(f"##{letter}" for letter in LETTERS)]
    marks |= {200 + i: piece for i, piece in enumerate(pieces)}
    vocabulary = {marks.get(i, f"[unused{i}]"): i for i in range(1100)}
    transformers.BertTokenizer(vocab=vocabulary).save_pretrained(path)
    size = {"shortest_edge": PIXELS, "longest_edge": 2 * PIXELS}
    transformers.GroundingDinoImageProcessorPil(size=size).save_pretrained(path)
    return path


def owlv2(path: Path) -> Path:
    """An OWLv2 of one layer each."""
    _, transformers = libraries()
    entries = ["<|startoftext|>", "<|endoftext|>", *LETTERS, *(f"{c}</w>" for c in LETTERS)]
    vocabulary = {entry: i + 1 for i, entry in enumerate(entries)} | {"!": 0}
    tower = {
        "hidden_size": 32,
        "intermediate_size": 64,
        "num_hidden_layers": 1,
        "num_attention_heads": 2,
    }
    config = transformers.Owlv2Config(
        text_config={
            **tower,
            "vocab_size": len(vocabulary),
            "bos_token_id": 1,
            "eos_token_id": 2,
            "max_position_embeddings": 32,
        },
        vision_config={**tower, "image_size": PIXELS, "patch_size": 16},
        projection_dim=32,
    )
    transformers.Owlv2ForObjectDetection(config).save_pretrained(path)
    transformers.CLIPTokenizer(vocab=vocabulary, merges=[], pad_token="!").save_pretrained(path)
    size = {"height": PIXELS, "width": PIXELS}
    transformers.Owlv2ImageProcessorPil(size=size).save_pretrained(path)
    return path


def sam(path: Path) -> Path:
    """A SAM of two layers."""
    _, transformers = libraries()
    config = transformers.SamConfig(
        vision_config={
            "hidden_size": 16,
            "output_channels": 16,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "image_size": PIXELS,
            "patch_size": 8,
            "window_size": 4,
            "global_attn_indexes": [1],
            "num_pos_feats": 8,
            "initializer_range": 0.5,
        },
        prompt_encoder_config={
            "hidden_size": 16,
            "image_size": PIXELS,
            "patch_size": 8,
            "mask_input_channels": 4,
        },
        mask_decoder_config=_decoder(),
    )
    transformers.SamModel(config).save_pretrained(path)
    edge = {"longest_edge": PIXELS}
    pad = {"height": PIXELS, "width": PIXELS}
    transformers.SamImageProcessorPil(size=edge, pad_size=pad).save_pretrained(path)
    return path


def sam2(path: Path) -> Path:
    """A SAM 2 of five layers."""
    _, transformers = libraries()
    config = transformers.Sam2Config(
        vision_config=transformers.Sam2VisionConfig(
            backbone_config=transformers.Sam2HieraDetConfig(
                hidden_size=8,
                image_size=[PIXELS, PIXELS],
                blocks_per_stage=[1, 1, 2, 1],
                embed_dim_per_stage=[8, 16, 32, 64],
                num_attention_heads_per_stage=[1, 1, 2, 2],
                window_size_per_stage=[4, 4, 4, 2],
                window_positional_embedding_background_size=[4, 4],
                global_attention_blocks=[3],
            ),
            backbone_channel_list=[64, 32, 16, 8],
            backbone_feature_sizes=[[16, 16], [8, 8], [4, 4]],
            fpn_hidden_size=16,
        ),
        prompt_encoder_config={
            "hidden_size": 16,
            "image_size": PIXELS,
            "patch_size": 16,
            "mask_input_channels": 4,
        },
        mask_decoder_config=_decoder(),
    )
    transformers.Sam2Model(config).save_pretrained(path)
    return path


def siglip(path: Path) -> Path:
    """A SigLIP of two layers, with a tokenizer of a few words."""
    _, transformers = libraries()
    tokenizers = pytest.importorskip("tokenizers")
    tower = {
        "hidden_size": 24,
        "intermediate_size": 48,
        "num_hidden_layers": 2,
        "num_attention_heads": 2,
    }
    config = transformers.SiglipConfig(
        text_config={
            **tower,
            "vocab_size": 16,
            "bos_token_id": 1,
            "eos_token_id": 2,
            "max_position_embeddings": 16,
        },
        vision_config={**tower, "image_size": 32, "patch_size": 8},
    )
    model = transformers.SiglipModel(config)
    model.logit_scale.data.fill_(2.0)
    model.save_pretrained(path)
    known = ["<pad>", "<unk>", "</s>", "a", "mug", "plate", "open", "microwave", "with", "coffee"]
    entries = {word: i for i, word in enumerate(known)}
    words = tokenizers.Tokenizer(tokenizers.models.WordLevel(entries, unk_token="<unk>"))
    words.pre_tokenizer = tokenizers.pre_tokenizers.Whitespace()
    transformers.PreTrainedTokenizerFast(
        tokenizer_object=words, pad_token="<pad>", unk_token="<unk>", eos_token="</s>"
    ).save_pretrained(path)
    transformers.SiglipImageProcessorPil(size={"height": 32, "width": 32}).save_pretrained(path)
    return path


def _decoder() -> dict[str, Any]:
    return {
        "hidden_size": 16,
        "mlp_dim": 32,
        "num_attention_heads": 2,
        "iou_head_hidden_dim": 16,
    }
